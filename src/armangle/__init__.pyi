"""The public names, for type checkers; __init__.py imports them when they are first used."""

from . import errors as errors
from . import gradients as gradients
from . import jax as jax
from . import kuka as kuka
from . import plots as plots
from . import torch as torch
from . import viewer as viewer
from ._core import (
    ISA as ISA,
)
from ._core import (
    __version__ as __version__,
)
from ._threads import (
    set_threads as set_threads,
)
from ._threads import (
    threads as threads,
)
from .arm.arcs import (
    ArcEnd as ArcEnd,
)
from .arm.arcs import (
    ArcSet as ArcSet,
)
from .arm.arm import (
    Arm as Arm,
)
from .arm.arm import (
    nearest_rotation as nearest_rotation,
)
from .arm.configuration import (
    gc_index as gc_index,
)
from .arm.configuration import (
    gc_signs as gc_signs,
)
from .arm.deviation import ChainDeviation as ChainDeviation
from .arm.diagnosis import (
    Branch as Branch,
)
from .arm.diagnosis import (
    Diagnosis as Diagnosis,
)
from .arm.diagnosis import (
    Opening as Opening,
)
from .arm.diagnosis import (
    Verdict as Verdict,
)
from .arm.freedom import Freedom as Freedom
from .arm.joint_function import JointFunction as JointFunction
from .arm.solution import (
    Solution as Solution,
)
from .arm.solution import (
    Solutions as Solutions,
)
from .errors import (
    ArmangleError as ArmangleError,
)
from .errors import (
    CollisionError as CollisionError,
)
from .errors import (
    InputError as InputError,
)
from .errors import (
    LimitError as LimitError,
)
from .errors import (
    MissingExtraError as MissingExtraError,
)
from .errors import (
    ModelError as ModelError,
)
from .errors import (
    NoSolutionError as NoSolutionError,
)
from .errors import (
    OutputError as OutputError,
)
from .errors import (
    PathError as PathError,
)
from .errors import (
    SceneError as SceneError,
)
from .errors import (
    UnreachableError as UnreachableError,
)
from .errors import (
    UnsupportedError as UnsupportedError,
)
from .files.clouds import load_cloud as load_cloud
from .files.fields import load_field as load_field
from .files.scenes import (
    load_body as load_body,
)
from .files.scenes import (
    load_scene as load_scene,
)
from .files.tables import (
    JointTable as JointTable,
)
from .files.tables import (
    load_joints as load_joints,
)
from .files.tables import (
    load_poses as load_poses,
)
from .files.tables import (
    save as save,
)
from .files.trajectories import (
    TrajectoryTable as TrajectoryTable,
)
from .files.trajectories import (
    load_trajectory as load_trajectory,
)
from .models.body import Body as Body
from .models.catalogue import catalogue as catalogue
from .models.description import ImportReport as ImportReport
from .models.dh import dh_chain as dh_chain
from .motion.following import follow as follow
from .motion.joining import join as join
from .motion.joint_path import (
    JointPath as JointPath,
)
from .motion.joint_path import (
    PathPoint as PathPoint,
)
from .motion.paths import (
    CircularArc as CircularArc,
)
from .motion.paths import (
    Deviation as Deviation,
)
from .motion.paths import (
    Line as Line,
)
from .motion.paths import (
    Path as Path,
)
from .motion.paths import (
    Screw as Screw,
)
from .motion.paths import (
    Segments as Segments,
)
from .motion.paths import (
    Waypoints as Waypoints,
)
from .motion.planning import (
    Objective as Objective,
)
from .motion.planning import (
    plan as plan,
)
from .motion.policies import (
    Centre as Centre,
)
from .motion.policies import (
    Hold as Hold,
)
from .motion.policies import (
    Repulsion as Repulsion,
)
from .motion.policies import (
    Towards as Towards,
)
from .motion.stepping import (
    Resolution as Resolution,
)
from .motion.stepping import (
    Step as Step,
)
from .motion.stepping import (
    resolve as resolve,
)
from .motion.stepping import (
    step as step,
)
from .motion.tracking import (
    HandFilter as HandFilter,
)
from .motion.tracking import (
    Tracked as Tracked,
)
from .motion.tracking import (
    Tracker as Tracker,
)
from .motion.tracking import (
    Tracking as Tracking,
)
from .poses import pose as pose
from .reach.placement import (
    Placement as Placement,
)
from .reach.placement import (
    place as place,
)
from .reach.reach_map import (
    ReachMap as ReachMap,
)
from .reach.reach_map import (
    reach_map as reach_map,
)
from .reach.voxels import Voxels as Voxels
from .scenes.clearance import Clearance as Clearance
from .scenes.scene import Scene as Scene
from .scenes.shapes import (
    Ball as Ball,
)
from .scenes.shapes import (
    Box as Box,
)
from .scenes.shapes import (
    Capsule as Capsule,
)
from .scenes.shapes import (
    Cloud as Cloud,
)
from .scenes.shapes import (
    Field as Field,
)
from .scenes.shapes import (
    HalfSpace as HalfSpace,
)
from .scenes.shapes import (
    Hull as Hull,
)
from .status import Status as Status
from .timing.retiming import retime as retime
from .timing.trajectory import (
    SpeedLoss as SpeedLoss,
)
from .timing.trajectory import (
    Trajectory as Trajectory,
)
from .timing.trajectory import (
    TrajectoryPoint as TrajectoryPoint,
)

__all__: tuple[str, ...]
_HOME: dict[str, str]
