"""A MuJoCo specification reduced to its kinematics, and its removed bounds of joints."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

# Users are deleted before their elements: deleting an element may delete its users, and then their handles
# are invalid.
_UNUSED = (
    "sensors", "actuators", "keys", "tuples", "pairs", "excludes", "tendons", "skins", "flexes",
    "geoms", "cameras", "lights", "meshes", "hfields", "materials", "textures", "plugins",
)  # fmt: skip


@dataclass
class Unused:
    """Bounds of a model's joints that are not used.

    `servos`: by joint, the angles (rad) between which its position servo may be commanded. `tendons` with
    limits or an equality, with the joints that they bind; None if mujoco does not tell.
    """

    servos: dict[str, tuple[float, float]] = field(default_factory=dict)
    tendons: list[tuple[str, set[str] | None]] = field(default_factory=list)


def strip(spec: Any, mujoco: Any) -> Unused:
    """Delete everything but bodies, joints, sites and their equalities from the model, in place.

    Returns the bounds of the deleted position servos and tendons.

    Every body gets the same mass: bodies with a mass from shapes, including attached ones, would not compile.
    """
    unused = Unused(_servos(spec, mujoco), _tendons(spec, mujoco))
    kept = (mujoco.mjtEq.mjEQ_JOINT, mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD)
    _delete(spec, [equality for equality in spec.equalities if equality.type not in kept])
    for kind in _UNUSED:
        _delete(spec, list(getattr(spec, kind)))
    for site in spec.sites:
        site.material = ""
    for body in spec.bodies:
        body.plugin.active = False
        body.mass, body.inertia, body.fullinertia = 1.0, (1.0, 1.0, 1.0), (math.nan,) * 6
        body.explicitinertial = True
    spec.compiler.inertiafromgeom = 0
    spec.compiler.fusestatic = False
    return unused


def _delete(spec: Any, elements: list[Any]) -> None:
    """Delete elements of one kind that were just listed."""
    for element in elements:
        if hasattr(spec, "delete"):
            spec.delete(element)
        else:  # mujoco of early 2025
            element.delete()


def _servos(spec: Any, mujoco: Any) -> dict[str, tuple[float, float]]:
    """Return the angles (rad) between which position servos may be commanded, by joint name.

    At rest gain * ctrl + bias_0 + bias_1 * gear * q = 0 (MuJoCo: general actuator, affine bias).
    """
    servos = dict[str, tuple[float, float]]()
    for actuator in spec.actuators:
        gain, bias, gear = float(actuator.gainprm[0]), actuator.biasprm, float(actuator.gear[0])
        low, high = (float(end) for end in actuator.ctrlrange)
        limited = int(actuator.ctrllimited) == 1 or (int(actuator.ctrllimited) == 2 and low < high)
        joint = actuator.trntype == mujoco.mjtTrn.mjTRN_JOINT
        affine = (
            actuator.biastype == mujoco.mjtBias.mjBIAS_AFFINE
            and actuator.gaintype == mujoco.mjtGain.mjGAIN_FIXED
        )
        if joint and affine and limited and gain and gear and bias[1]:
            ends = [-(gain * ctrl + float(bias[0])) / (float(bias[1]) * gear) for ctrl in (low, high)]
            servos[str(actuator.target)] = min(ends), max(ends)
    return servos


def _tendons(spec: Any, mujoco: Any) -> list[tuple[str, set[str] | None]]:
    """Return the names of tendons with limits or an equality, each with the joints of `_bound`."""
    equal = mujoco.mjtEq.mjEQ_TENDON
    tied = {
        name for one in spec.equalities if one.type == equal and one.active for name in (one.name1, one.name2)
    }
    found = list[tuple[str, set[str] | None]]()
    for tendon in spec.tendons:
        low, high = (float(end) for end in tendon.range)
        limited = int(tendon.limited) == 1 or (int(tendon.limited) == 2 and low < high)
        if limited or tendon.name in tied:
            found.append((str(tendon.name), _bound(tendon, mujoco)))
    return found


def _bound(tendon: Any, mujoco: Any) -> set[str] | None:
    """Return the names of joints that a tendon binds: none for a spatial one; None if mujoco does not say."""
    if not hasattr(tendon, "path"):  # mujoco before 3.4
        return None
    kind = mujoco.mjtWrap.mjWRAP_JOINT
    wraps = [wrap for wrap in tendon.path if wrap.type == kind]
    return {str(getattr(wrap.target, "name", wrap.target)) for wrap in wraps}
