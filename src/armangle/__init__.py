"""Exact inverse kinematics for 7-axis arms with spherical shoulder, elbow and spherical wrist (S-R-S).

A pose, a global configuration ``gc`` (0..7) and an arm angle ``psi`` give exactly one joint vector ``q``;
joint limits and singularities are arcs of ``psi``. After Faria et al. (2018), "Position-based kinematics for
7-DoF serial manipulators with global configuration control, joint limit and singularity avoidance".

Radians and metres throughout; leading batch axes everywhere.
"""

from ._catalogue import catalogue
from ._core import ISA, __version__
from .arcs import ArcEnd, ArcSet
from .arm import Arm, nearest_rotation
from .configuration import gc_index, gc_signs
from .description import ImportReport
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
    ShapeError,
    UnknownRobotError,
    UnreachableError,
    UrdfError,
)
from .joint_function import JointFunction
from .joint_path import JointPath
from .policies import Centre, Hold, Repulsion
from .status import Status
from .stepping import Resolution, Step, follow, resolve, step

__all__ = [
    "ISA",
    "ArcEnd",
    "ArcSet",
    "Arm",
    "ArmangleError",
    "Centre",
    "ConfigurationError",
    "FileFormatError",
    "Hold",
    "ImportReport",
    "InputError",
    "JointFunction",
    "JointPath",
    "LimitError",
    "MissingExtraError",
    "NotFiniteError",
    "NotRotationError",
    "NotSRSError",
    "OutputError",
    "PathError",
    "PolicyError",
    "Repulsion",
    "Resolution",
    "ShapeError",
    "Status",
    "Step",
    "UnknownRobotError",
    "UnreachableError",
    "UrdfError",
    "__version__",
    "catalogue",
    "follow",
    "gc_index",
    "gc_signs",
    "nearest_rotation",
    "resolve",
    "step",
]
