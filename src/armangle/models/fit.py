"""The S-R-S arm nearest to a nearly S-R-S chain: least squares over configurations.

Moving the axes at q = 0 into place instead would leave errors two to four times as large.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from .._arrays import JOINTS
from .chain import Chain, FloatArray, chain_of, rotation_about, translation
from .description import ArmDescription

_POSTURES = 100
_SEED = 11
_MOST_STEPS = 12
_LEAST_STEP = 1e-9  # m or rad
_DIFFERENCE = 1e-6  # m or rad
_LENGTHS = ("d_se", "d_ew", "a_3", "a_4", "d_4")  # d_bs and d_wf are translations of base and tool
_ZEROS = range(1, JOINTS - 1)  # the zeros of joints 1 and 7 are rotations of base and tool


def fit(start: ArmDescription, chain: Chain) -> ArmDescription:
    """Return the S-R-S arm whose tip is nearest to that of a chain, in the mean square over configurations
    within its limits.

    Lengths, elbow offsets, zeros, base and tool are free; an angle is weighted by its effect at the end of
    the reach. Gauss-Newton from `start`, in the joint coordinates of the chain; a step that does not improve
    the fit is halved. Zeros, base and tool are not in the form that `detect` writes.
    """
    q = _postures(chain)
    wanted = chain.forward(q)
    lever = float(np.hypot(start.d_se, start.a_3) + np.hypot(start.d_ew, start.a_4))
    arm, error = start, _error(start, q, wanted, lever)
    count = len(_LENGTHS) + len(_ZEROS) + 12
    for _ in range(_MOST_STEPS):
        moved = [_error(_moved(arm, _DIFFERENCE * unit), q, wanted, lever) for unit in np.eye(count)]
        slope = (np.array(moved) - error).T / _DIFFERENCE
        step = np.asarray(np.linalg.lstsq(slope, -error, rcond=None)[0], dtype=np.float64)
        while np.abs(step).max() > _LEAST_STEP:
            tried = _moved(arm, step)
            left = _error(tried, q, wanted, lever)
            if left @ left < error @ error:
                arm, error = tried, left
                break
            step = step / 2.0
        if np.abs(step).max() <= _LEAST_STEP:
            break
    return arm


def _postures(chain: Chain) -> FloatArray:
    """Return random configurations (n, 7), rad, within the limits; ranges of 0, 2π or more become [-π, π]."""
    lower = np.array([joint.lower for joint in chain.joints])
    upper = np.array([joint.upper for joint in chain.joints])
    wide = ~(upper - lower < 2.0 * np.pi) | (lower == upper)
    lower, upper = np.where(wide, -np.pi, lower), np.where(wide, np.pi, upper)
    return np.asarray(
        np.random.default_rng(_SEED).uniform(lower, upper, (_POSTURES, JOINTS)), dtype=np.float64
    )


def _error(arm: ArmDescription, q: FloatArray, wanted: FloatArray, lever: float) -> FloatArray:
    """Return errors of the tip, wanted at poses (n, 4, 4), at q (n, 7), m: of rotations times `lever`."""
    found = chain_of(arm).forward(q)
    turn = np.swapaxes(wanted[:, :3, :3], 1, 2) @ found[:, :3, :3]
    axis = turn - np.swapaxes(turn, 1, 2)
    turns = 0.5 * np.stack([axis[:, 2, 1], axis[:, 0, 2], axis[:, 1, 0]], axis=-1)
    return np.concatenate([(found - wanted)[:, :3, 3].ravel(), lever * turns.ravel()])


def _moved(arm: ArmDescription, step: FloatArray) -> ArmDescription:
    """Return the arm after a small step: of lengths (m) and zeros (rad), then twists of base and tool."""
    lengths, zeros, base, tool = np.split(step, np.cumsum([len(_LENGTHS), len(_ZEROS), 6]))
    offsets = np.array(arm.offsets)
    offsets[list(_ZEROS)] += zeros
    return replace(
        arm,
        offsets=tuple(offsets.tolist()),
        base=arm.base @ _small(base),
        tool=_small(tool) @ arm.tool,
        **{name: getattr(arm, name) + float(by) for name, by in zip(_LENGTHS, lengths, strict=True)},
    )


def _small(twist: FloatArray) -> FloatArray:
    """Return the frame (4, 4) of a twist: translation (m), then rotation vector (rad)."""
    angle = float(np.linalg.norm(twist[3:]))
    axis = twist[3:] / angle if angle else np.array([0.0, 0.0, 1.0])
    return np.asarray(translation(twist[:3]) @ rotation_about(axis, np.float64(angle)), dtype=np.float64)
