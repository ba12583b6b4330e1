"""Colours of joints and intervals, and drawn angles: shared by plots and viewer."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ._arrays import Floats

# Okabe and Ito's eight colours, distinguishable with all common kinds of colour vision.
BLACK = "#000000"
ORANGE, SKY, GREEN, YELLOW = "#E69F00", "#56B4E9", "#009E73", "#F0E442"
BLUE, VERMILION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
JOINT_COLOURS = (ORANGE, SKY, GREEN, YELLOW, BLUE, VERMILION, PURPLE)
CURVES = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY, BLACK)
# One legend for every plot of the arm angle: the circle, the strip, the maps, the README and the viewer. A
# free interval is a light, wide band. A blocked one is darker and narrower, in the colour of the joint or the
# obstacle.
FREE = "#A6DBA0"
OBSTACLE = "#404040"
PALE = "#D9D9D9"  # unproven; lines of a grid
MID = "#7F7F7F"
FREE_WIDTH, BLOCKED_WIDTH = 7.0, 3.0  # of a line, points

FULL_TURN = 360.0


def wrapped_degrees(psi: Floats) -> Floats:
    """Return angles (rad) in degrees in [-180, 180)."""
    return (np.degrees(psi) + FULL_TURN / 2) % FULL_TURN - FULL_TURN / 2


def unjoined(x: Floats, y: Floats, jump: float = FULL_TURN / 2) -> tuple[Floats, Floats]:
    """Return a curve with NaN where y jumps by more than `jump`, so that no line is drawn there."""
    at = np.flatnonzero(np.abs(np.diff(y)) > jump) + 1
    return np.insert(x, at, np.nan), np.insert(y, at, np.nan)


def pieces(intervals: NDArray[np.float64]) -> list[tuple[float, float]]:
    """Return arcs (k, 2) in rad as pieces within [-180, 180] degrees, cut at ±180."""
    half = FULL_TURN / 2
    out = []
    for lower, upper in np.degrees(intervals[~np.isnan(intervals[:, 0])]):
        out.append((lower, min(upper, half)))
        if upper > half:
            out.append((-half, upper - FULL_TURN))
    return out
