"""Where motion tells the kinds of arms apart: options, curves and trackers of each."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from .. import _core
from .._arrays import Floats, Ints
from ..arm.arm import Arm
from ..arm.chain import edge_of_reach
from ..arm.chain import unsupported as chain_lacks
from ..arm.joint_map import to_theta
from ..arm.offset import OffsetArm
from ..arm.offset import unsupported as offset_lacks
from ..errors import InputError, UnreachableError
from ..status import Status
from .curves import AnyCurve, Curve, OffsetCurve
from .policies import Towards

AnyTracker = _core.Tracker | _core.ChainTracker | _core.OffsetTracker | _core.OffsetChainTracker
_SHUT = 1e-9  # sine of a hinge that is 0 up to rounding


def check_step(arm: Arm, roll: object, carry: object, policy: object, allowed: object) -> None:
    """Raise `UnsupportedError` for options of a step that the kind of arm does not support.

    `InputError` if psi is the value of joint 7, which a free roll keeps, and the policy or `allowed` asks for
    another.
    """
    if not isinstance(arm, OffsetArm):
        return
    if not (carry is None or (isinstance(carry, str) and carry == "psi")):
        raise offset_lacks("carry=")
    wished = isinstance(policy, Towards) and policy.psi is not None
    if roll == "free" and arm.redundancy == "joint_7" and (wished or allowed is not None):
        raise InputError(
            f"roll is 'free': joint 7 keeps its value, which is psi, and {'policy' if wished else 'allowed'} "
            "asks for another"
        )


def check_plan(arm: Arm, scene: object) -> None:
    """Raise if the kind of arm has no plans among obstacles that move."""
    if not isinstance(arm, OffsetArm) and arm.geometry.chain is not None and callable(scene):
        raise chain_lacks("plan with a scene that moves", "follow, which takes one for each row")


def planned_arm(arm: Arm) -> Arm:
    """Return the arm for which a plan's obstacles are prepared: of a nearly S-R-S arm the nominal one."""
    return arm if isinstance(arm, OffsetArm) else arm._nominal


def branches_of(arm: Arm, q: Floats, gc: Ints) -> Ints:
    """Return the branch of each row; if θ2 or θ6 is 0 and two coincide, that of neighbouring rows."""
    if isinstance(arm, OffsetArm):
        return gc
    out = gc.copy()
    hinges = np.sin(to_theta(arm._handle, np.ascontiguousarray(q))[:, [1, 5]])
    for sine, bit in zip(hinges.T, (1, 4), strict=True):
        known = np.flatnonzero(np.abs(sine) > _SHUT)
        if len(known):
            near = known[np.clip(np.searchsorted(known, np.arange(len(out))), 0, len(known) - 1)]
            out = (out & ~bit) | (out[near] & bit)
    return out


def curve_through(
    arm: Arm, segments: Floats, s: Floats, q: Floats, psi: Floats, gc: Ints
) -> tuple[AnyCurve, int]:
    """Return the curve through rows on the path of the end effector; psi or a joint is linear in s.

    Also the row after which no motion reaches the branch of the next, or -1.
    """
    if isinstance(arm, OffsetArm):
        between = OffsetCurve(segments, s, psi, q, int(gc[0]))
        return between, between.torn(arm._handle, gc)
    plane, stretches, torn = arm._handle.curve_through(segments, s, q, psi, gc)
    return Curve(segments, stretches, plane, int(gc[0])), torn


def why_unreached(arm: Arm, pose: Floats, status: int) -> str:
    """Return by how much a pose is out of reach, or near the edge of reach of a chain, as a sentence with a
    space before it; "" for an arm with an offset wrist or shoulder.
    """
    if isinstance(arm, OffsetArm):
        return ""
    if status == Status.NEAR_SINGULAR:
        return edge_of_reach(arm, pose)
    try:
        arm.inverse(pose, 0.0, 0, limits=False)
    except UnreachableError as error:
        told = str(error).capitalize()
        return f" {told}{'' if told.endswith('?') else '.'}"
    return ""


def tracker_of(
    arm: Arm, given: Floats, leading: Callable[[Arm], _core.Scene | None], about: Any
) -> AnyTracker:
    """Return the core's control loop of an arm from checked numbers; `leading` prepares the scene for the
    nominal arm, whose tracker leads that of another kind; `about` is the scene for this one.
    """
    handle: Any = arm.with_(singularity_margin=0.0)._handle  # to a tracker the margin is a wish, in `given`
    if isinstance(arm, OffsetArm):
        made = _core.OffsetTracker if arm.geometry.chain is None else _core.OffsetChainTracker
        return made(handle, given, leading(arm._rows), about)
    if arm.geometry.chain is None:
        return _core.Tracker(handle, given, about)
    return _core.ChainTracker(handle, given, leading(arm._nominal), about)
