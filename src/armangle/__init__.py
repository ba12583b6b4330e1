"""Exact inverse kinematics for 7-axis arms with spherical shoulder, elbow and spherical wrist (S-R-S).

A pose, a global configuration ``gc`` (0..7) and an arm angle ``psi`` determine exactly one joint
configuration ``q``; joint limits and singularities are arcs of ``psi``. After Faria et al. (2018),
"Position-based kinematics for 7-DoF serial manipulators with global configuration control, joint limit and
singularity avoidance".

Radians and metres throughout; leading batch axes everywhere. Names are imported on first use, so that
``armangle --help`` needs neither NumPy nor the compiled core.
"""

from importlib import import_module
from sys import modules
from typing import Any

# The module of each name; __init__.pyi has the same list for type checkers.
_NAMES = {
    "_core": "ISA __version__",
    "_threads": "set_threads threads",
    "arm.arcs": "ArcSet",
    "arm.arm": "Arm nearest_rotation",
    "arm.configuration": "gc_index gc_signs",
    "arm.solution": "Solution",
    "errors": "ArmangleError CollisionError InputError LimitError MissingExtraError ModelError "
    "NoSolutionError OutputError PathError SceneError UnreachableError UnsupportedError",
    "models.body": "Body",
    "models.catalogue": "catalogue",
    "models.dh": "dh_chain",
    "motion.following": "follow",
    "motion.joining": "join",
    "motion.joint_path": "JointPath",
    "motion.paths": "CircularArc Line Path Screw Segments Waypoints",
    "motion.planning": "Objective plan",
    "motion.policies": "Centre Hold Repulsion Towards",
    "motion.stepping": "resolve step",
    "motion.tracking": "HandFilter Tracker Tracking",
    "poses": "pose",
    "reach.placement": "place",
    "reach.reach_map": "ReachMap reach_map",
    "scenes.scene": "Scene",
    "scenes.shapes": "Ball Box Capsule Cloud Field HalfSpace Hull",
    "status": "Status",
    "timing.retiming": "retime",
    "timing.trajectory": "Trajectory",
}
_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}
_MODULES = ("errors", "gradients", "io", "jax", "kuka", "plots", "torch", "types", "viewer")

__all__ = tuple(sorted(_HOME))


def __getattr__(name: str) -> Any:
    """Return a public name or module, imported on first use."""
    if name in _HOME:
        value = getattr(import_module(f".{_HOME[name]}", __name__), name)
    elif name in _MODULES:
        value = import_module(f".{name}", __name__)
    else:
        told = f"module {__name__!r} has no attribute {name!r}"
        if not name.startswith("_") and hasattr(arm := import_module(".arm.arm", __name__).Arm, name):
            made = isinstance(vars(arm).get(name), classmethod)
            told += f": it is of {'the class Arm, armangle.Arm' if made else 'an Arm, arm'}.{name}"
        raise AttributeError(told, name=name, obj=modules[__name__])
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names and modules."""
    return sorted({*__all__, *_MODULES})
