"""Bounds of trajectories, between their rows, by differences of joints alone."""

from __future__ import annotations

import numpy as np

import armangle as aa

Array = np.ndarray


def kept(found: aa.Trajectory, velocity: Array, a: float, j: float | None) -> None:
    """Check bounds (rad/s, rad/s², rad/s³) between the rows, and rest at both ends."""
    t = np.linspace(0.0, found.duration, 2001)
    h = t[1]
    speed = np.diff(found.at(t).q, axis=0) / h
    change = np.diff(speed, axis=0) / h
    assert (np.abs(speed) <= velocity * (1 + 1e-6)).all()
    assert np.abs(change).max() <= a * 1.002
    if j is not None:
        assert np.abs(np.diff(change, axis=0)).max() / h <= j * 1.01
    assert np.abs(found.qd[[0, -1]]).max() < 1e-9
