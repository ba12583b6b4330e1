"""Joint values q and model angles theta = s q + o, of arrays; the formula is in the core, `joint_map.hpp`."""

from __future__ import annotations

import numpy as np

from .. import _core
from .._arrays import Floats


def to_theta(arm: _core.Arm, q: Floats) -> Floats:
    """Return the model angles (..., 7) of joint values (..., 7), rad; `arm` is the core's."""
    out = np.empty_like(q)
    arm.theta_many(q, out)
    return out


def to_q(arm: _core.Arm, theta: Floats) -> Floats:
    """Return the joint values (..., 7) of model angles (..., 7), rad; no multiple of 2π is added."""
    out = np.empty_like(theta)
    arm.q_many(theta, out)
    return out
