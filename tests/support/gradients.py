"""What the laws of derivatives share: postures away from singular ones, poses moved by twists."""

from __future__ import annotations

import numpy as np

import armangle as aa

from . import draw
from .calibrated import calibrated
from .strategies import bends

NAMES = ("kuka_iiwa7_r800", "openarm_v10", "barrett_wam7")
FAMILIES = (*NAMES, "franka_fr3", "fetch", "calibrated franka_fr3", "calibrated kinova_movo")
HOME = np.array([0.1, 0.0, 0.2, -1.5, 0.3, 1.0, 0.4])
"""θ2 is 0: joints 1 to 3 have no derivative there, joints 4 to 7 have."""


def calm(arm: aa.Arm, q: np.ndarray) -> np.ndarray:
    """Those of the configurations about 0.2 rad or more from singularities; of an arm with an offset, those
    at which no derivative of the inverse reaches 20.
    """
    if arm.redundancy != "arm_angle":
        return q[np.abs(aa.gradients.inverse(arm, *arm.forward(q), on_error="nan")).max(axis=(1, 2)) < 20.0]
    return q[(np.abs(np.sin(bends(arm, q))) > 0.2).all(axis=1)]


def named(name: str) -> aa.Arm:
    """An arm of the catalogue; "calibrated NAME": one with links off at random by 1 mm and 1 mrad."""
    own = name.startswith("calibrated ")
    return calibrated(name.split()[1], 1.0, 1.0) if own else aa.Arm.from_catalogue(name)


def postures(name: str, count: int, *seed: int) -> tuple[aa.Arm, np.ndarray]:
    """An arm of `named` on a tilted base, and at most `count` configurations within its limits, far from
    singularities.
    """
    arm = named(name).with_(base=aa.pose([0.1, 0.2, 0.3], rpy=[0.5, 0.4, 0.3]))
    low, high = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    return arm, calm(arm, draw.generator(*seed).uniform(low, high, (count, 7)))


def moved(pose: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """Poses after a twist (..., 6) in base coordinates: translation (m), then rotation vector (rad)."""
    out = aa.pose(np.zeros(3), rotvec=twist[..., 3:]) @ pose
    out[..., :3, 3] = pose[..., :3, 3] + twist[..., :3]
    return out


def change(pose: np.ndarray, twist: np.ndarray) -> np.ndarray:
    """The derivative of the entries of poses for a twist."""
    out = np.zeros_like(pose)
    out[..., :3, :3] = np.cross(twist[..., None, 3:], np.swapaxes(pose[..., :3, :3], -1, -2)).swapaxes(-1, -2)
    out[..., :3, 3] = twist[..., :3]
    return out
