"""Exact inverse kinematics for 7-axis arms with spherical shoulder, elbow and spherical wrist (S-R-S).

A pose, a global configuration ``gc`` (0..7) and an arm angle ``psi`` give exactly one joint vector
``q``; joint limits and singularities are arcs of ``psi``. After Faria et al. (2018), "Position-based
kinematics for 7-DoF serial manipulators with global configuration control, joint limit and
singularity avoidance".

Radians and metres throughout; leading batch axes everywhere. Names are imported when first used, so that
``armangle --help`` needs neither NumPy nor the compiled core.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from ._core import ISA, __version__
    from .arm.arcs import ArcEnd, ArcSet
    from .arm.arm import Arm, nearest_rotation
    from .arm.configuration import gc_index, gc_signs
    from .arm.diagnosis import Branch, Diagnosis, Opening, Verdict
    from .arm.joint_function import JointFunction
    from .errors import (
        ArmangleError,
        ConfigurationError,
        FileFormatError,
        InputError,
        LimitError,
        MissingExtraError,
        NotFiniteError,
        NotRotationError,
        NotSRSError,
        OutputError,
        PathError,
        PolicyError,
        PortError,
        ShapeError,
        UnknownRobotError,
        UnreachableError,
        UrdfError,
    )
    from .files.tables import JointTable, load_joints, load_poses, save
    from .models.catalogue import catalogue
    from .models.description import ImportReport
    from .motion.following import follow
    from .motion.joint_path import JointPath, PathPoint
    from .motion.paths import CircularArc, Line, Path, Screw, Waypoints
    from .motion.planning import Objective, plan
    from .motion.policies import Centre, Hold, Repulsion
    from .motion.stepping import Resolution, Step, resolve, step
    from .status import Status
    from .timing.retiming import retime
    from .timing.trajectory import SpeedLoss, Trajectory, TrajectoryPoint

# Which module a name comes from: the imports above once more, for the interpreter.
_HOMES = {
    "_catalogue": "catalogue",
    "_core": "ISA __version__",
    "arcs": "ArcEnd ArcSet",
    "arm": "Arm nearest_rotation",
    "configuration": "gc_index gc_signs",
    "description": "ImportReport",
    "diagnosis": "Branch Diagnosis Opening Verdict",
    "errors": "ArmangleError ConfigurationError FileFormatError InputError LimitError MissingExtraError "
    "NotFiniteError NotRotationError NotSRSError OutputError PathError PolicyError PortError ShapeError "
    "UnknownRobotError UnreachableError UrdfError",
    "io": "JointTable load_joints load_poses save",
    "joint_function": "JointFunction",
    "joint_path": "JointPath PathPoint",
    "paths": "CircularArc Line Path Screw Waypoints",
    "planning": "Objective plan",
    "policies": "Centre Hold Repulsion",
    "retiming": "retime",
    "status": "Status",
    "following": "follow",
    "stepping": "Resolution Step resolve step",
    "trajectory": "SpeedLoss Trajectory TrajectoryPoint",
}
_HOME = {name: module for module, names in _HOMES.items() for name in names.split()}

__all__ = [
    "ISA",
    "ArcEnd",
    "ArcSet",
    "Arm",
    "ArmangleError",
    "Branch",
    "Centre",
    "CircularArc",
    "ConfigurationError",
    "Diagnosis",
    "FileFormatError",
    "Hold",
    "ImportReport",
    "InputError",
    "JointFunction",
    "JointPath",
    "JointTable",
    "LimitError",
    "Line",
    "MissingExtraError",
    "NotFiniteError",
    "NotRotationError",
    "NotSRSError",
    "Objective",
    "Opening",
    "OutputError",
    "Path",
    "PathError",
    "PathPoint",
    "PolicyError",
    "PortError",
    "Repulsion",
    "Resolution",
    "Screw",
    "ShapeError",
    "SpeedLoss",
    "Status",
    "Step",
    "Trajectory",
    "TrajectoryPoint",
    "UnknownRobotError",
    "UnreachableError",
    "UrdfError",
    "Verdict",
    "Waypoints",
    "__version__",
    "catalogue",
    "follow",
    "gc_index",
    "gc_signs",
    "load_joints",
    "load_poses",
    "nearest_rotation",
    "plan",
    "resolve",
    "retime",
    "save",
    "step",
]

if not TYPE_CHECKING:  # a type checker should see the names above and no others

    def __getattr__(name: str) -> Any:
        """Return a public name, imported from its home."""
        if name not in _HOME:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        value = getattr(import_module(f".{_HOME[name]}", __name__), name)
        globals()[name] = value
        return value


def __dir__() -> list[str]:
    """Return the public names, imported or not."""
    return sorted({*globals(), *__all__})
