"""The initial configuration of an arm: well inside its limits and bent, away from singularities."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from .._arrays import JOINTS, Floats
from ..arm.arm import Arm
from ..arm.joint_map import to_q, to_theta

_ENOUGH = 0.6  # rad: wanted distance to a limit and to a singularity
_SINGULAR = (1, 3, 5)  # joints 2, 4, 6, counted from 0: the shoulder, the elbow and the wrist
_WISH = (0.0, 0.6, 0.35, -1.4, 0.3, 0.9, 0.0)  # rad: the tool in front and low, the links in no common plane


def opening_posture(arm: Arm) -> Floats:
    """Return joints (7,), rad, within the limits, with shoulder, elbow and wrist bent.

    Each joint is chosen separately. Its range is given by the limits, and is cut where joint 2, 4 or 6 is
    singular, straight or folded. In each piece the joint takes its value of a usual configuration, moved to
    keep 0.6 rad from both ends; in a piece shorter than 1.2 rad it is in the middle. The piece with most room
    wins, among equals the one with the smallest move. So a joint keeps at least the smaller of 0.6 rad and a
    quarter of its range from limits and singularities.

    >>> from armangle import Arm
    >>> arm = Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1, lower=[-0.5] * 7, upper=[0.5] * 6 + [2.5])
    >>> opening_posture(arm).round(2).tolist()
    [0.0, 0.25, 0.0, -0.25, 0.0, 0.25, 1.0]
    """
    lower, upper = _one_turn(arm)
    straight = np.array([arm.geometry.delta if joint == 3 else 0.0 for joint in range(JOINTS)])
    ends = np.sort(to_theta(arm._handle, np.stack([lower, upper])) - straight, axis=0)
    bend = np.array([_chosen(joint, *ends[:, joint]) for joint in range(JOINTS)])
    joints: Floats = np.clip(to_q(arm._handle, bend + straight) + 0.0, arm.lower, arm.upper)
    return joints


def _one_turn(arm: Arm) -> tuple[Floats, Floats]:
    """Return the limits (rad), those more than 2π apart cut to the 2π nearest to 0."""
    turn = 2 * np.pi
    lower = np.maximum(arm.lower, np.minimum(-np.pi, arm.upper - turn))
    return lower, np.minimum(arm.upper, np.maximum(np.pi, arm.lower + turn))


def _chosen(joint: int, lower: float, upper: float) -> float:
    """Return the value of a joint 0..6 (counted from 0) in [lower, upper], rad, relative to the stretched
    arm.
    """
    cuts = np.pi * np.arange(np.ceil(lower / np.pi), np.floor(upper / np.pi) + 1)
    ends = np.unique([lower, *(cuts if joint in _SINGULAR else ()), upper])
    pieces = list(pairwise(ends)) or [(lower, upper)]
    wishes = (_WISH[joint], -_WISH[joint]) if joint in _SINGULAR else (0.5 * (lower + upper) + _WISH[joint],)
    found = []
    for wish in wishes:
        for low, high in pieces:
            room = min(0.5 * (high - low), _ENOUGH)
            place = float(np.clip(wish, low + room, high - room))
            found.append((round(-room, 9), round(abs(place - wish), 9), place))
    return min(found, key=lambda choice: choice[:2])[2]
