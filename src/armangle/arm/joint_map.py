"""Joint values q and model angles theta = s q + o, of arrays; the formula is in the core, `joint_map.hpp`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .._arrays import Floats

if TYPE_CHECKING:
    from .arm import Arm


def to_theta(arm: Arm, q: Floats) -> Floats:
    """Return the model angles (..., 7) of joint values (..., 7), rad."""
    out = np.empty_like(q)
    arm._handle.theta_many(q, out)
    return out


def to_q(arm: Arm, theta: Floats) -> Floats:
    """Return the joint values (..., 7) of model angles (..., 7), rad, on the turn as they come."""
    out = np.empty_like(theta)
    arm._handle.q_many(theta, out)
    return out
