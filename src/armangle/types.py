"""The classes of results, for annotations and documentation; functions return them."""

from .arm.arcs import ArcEnd
from .arm.deviation import ChainDeviation
from .arm.diagnosis import Branch, Diagnosis, Opening, Verdict
from .arm.freedom import Freedom
from .arm.geometry import Geometry
from .arm.joint_function import JointFunction
from .arm.solution import Solutions
from .models.description import ImportReport
from .motion.joint_path import PathPoint
from .motion.paths import Deviation
from .motion.stepping import Resolution, Step
from .motion.tracking import Tracked
from .reach.placement import Placement
from .reach.voxels import Voxels
from .scenes.clearance import Clearance
from .timing.trajectory import SpeedLoss, TrajectoryPoint

__all__ = [
    "ArcEnd",
    "Branch",
    "ChainDeviation",
    "Clearance",
    "Deviation",
    "Diagnosis",
    "Freedom",
    "Geometry",
    "ImportReport",
    "JointFunction",
    "Opening",
    "PathPoint",
    "Placement",
    "Resolution",
    "Solutions",
    "SpeedLoss",
    "Step",
    "Tracked",
    "TrajectoryPoint",
    "Verdict",
    "Voxels",
]
