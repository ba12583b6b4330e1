"""The public names, for type checkers; __init__.py imports them when they are first used."""

from . import errors as errors
from . import jax as jax
from . import kuka as kuka
from . import plots as plots
from . import torch as torch
from . import viewer as viewer
from ._core import (
    ISA as ISA,
    __version__ as __version__,
)
from .arm.arcs import (
    ArcEnd as ArcEnd,
    ArcSet as ArcSet,
)
from .arm.arm import (
    Arm as Arm,
    nearest_rotation as nearest_rotation,
)
from .arm.configuration import (
    gc_index as gc_index,
    gc_signs as gc_signs,
)
from .arm.deviation import ChainDeviation as ChainDeviation
from .arm.diagnosis import (
    Branch as Branch,
    Diagnosis as Diagnosis,
    Opening as Opening,
    Verdict as Verdict,
)
from .arm.freedom import Freedom as Freedom
from .arm.joint_function import JointFunction as JointFunction
from .arm.offset import OffsetArm as OffsetArm
from .arm.offset import OffsetSolution as OffsetSolution
from .arm.solution import Solution as Solution
from .arm.solution import Solutions as Solutions
from .errors import (
    ArmangleError as ArmangleError,
    ConfigurationError as ConfigurationError,
    FileFormatError as FileFormatError,
    InputError as InputError,
    LimitError as LimitError,
    MissingExtraError as MissingExtraError,
    NoSolutionError as NoSolutionError,
    NotFiniteError as NotFiniteError,
    NotRotationError as NotRotationError,
    NotSRSError as NotSRSError,
    OutputError as OutputError,
    PathError as PathError,
    PolicyError as PolicyError,
    PortError as PortError,
    SceneError as SceneError,
    ShapeError as ShapeError,
    UnknownRobotError as UnknownRobotError,
    UnreachableError as UnreachableError,
    UrdfError as UrdfError,
)
from .files.clouds import load_cloud as load_cloud
from .files.fields import load_field as load_field
from .files.scenes import load_body as load_body, load_scene as load_scene
from .files.tables import (
    JointTable as JointTable,
    load_joints as load_joints,
    load_poses as load_poses,
    save as save,
)
from .files.trajectories import (
    TrajectoryTable as TrajectoryTable,
    load_trajectory as load_trajectory,
)
from .models.body import Body as Body
from .models.catalogue import catalogue as catalogue
from .models.description import ImportReport as ImportReport
from .models.dh import dh_chain as dh_chain
from .models.offset import offset_catalogue as offset_catalogue
from .motion.following import follow as follow
from .motion.joining import join as join
from .motion.joint_path import (
    JointPath as JointPath,
    PathPoint as PathPoint,
)
from .motion.paths import (
    CircularArc as CircularArc,
    Deviation as Deviation,
    Line as Line,
    Path as Path,
    Screw as Screw,
    Segments as Segments,
    Waypoints as Waypoints,
)
from .motion.planning import (
    Objective as Objective,
    plan as plan,
)
from .motion.policies import (
    Centre as Centre,
    Hold as Hold,
    Repulsion as Repulsion,
    Towards as Towards,
)
from .motion.stepping import (
    Resolution as Resolution,
    Step as Step,
    resolve as resolve,
    step as step,
)
from .motion.tracking import (
    HandFilter as HandFilter,
    Tracked as Tracked,
    Tracker as Tracker,
    Tracking as Tracking,
)
from .poses import pose as pose
from .reach.placement import (
    Placement as Placement,
    place as place,
)
from .reach.reach_map import (
    ReachMap as ReachMap,
    reach_map as reach_map,
)
from .reach.voxels import Voxels as Voxels
from .scenes.clearance import (
    Clearance as Clearance,
    Widest as Widest,
)
from .scenes.scene import Scene as Scene
from .scenes.shapes import (
    Ball as Ball,
    Box as Box,
    Capsule as Capsule,
    Cloud as Cloud,
    Field as Field,
    HalfSpace as HalfSpace,
    Hull as Hull,
)
from .status import Status as Status
from .timing.retiming import retime as retime
from .timing.trajectory import (
    SpeedLoss as SpeedLoss,
    Trajectory as Trajectory,
    TrajectoryPoint as TrajectoryPoint,
)

__all__: tuple[str, ...]
_HOME: dict[str, str]
