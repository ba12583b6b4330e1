"""The public names, for type checkers; __init__.py imports them when they are first used."""

from . import errors as errors
from . import gradients as gradients
from . import io as io
from . import jax as jax
from . import kuka as kuka
from . import plots as plots
from . import torch as torch
from . import types as types
from . import viewer as viewer
from ._core import (
    ISA as ISA,
    __version__ as __version__,
)
from ._threads import (
    set_threads as set_threads,
    threads as threads,
)
from .arm.arcs import ArcSet as ArcSet
from .arm.arm import (
    Arm as Arm,
    nearest_rotation as nearest_rotation,
)
from .arm.configuration import (
    gc_index as gc_index,
    gc_signs as gc_signs,
)
from .arm.solution import Solution as Solution
from .errors import (
    ArmangleError as ArmangleError,
    CollisionError as CollisionError,
    InputError as InputError,
    LimitError as LimitError,
    MissingExtraError as MissingExtraError,
    ModelError as ModelError,
    NoSolutionError as NoSolutionError,
    OutputError as OutputError,
    PathError as PathError,
    SceneError as SceneError,
    UnreachableError as UnreachableError,
    UnsupportedError as UnsupportedError,
)
from .models.body import Body as Body
from .models.catalogue import catalogue as catalogue
from .models.dh import dh_chain as dh_chain
from .motion.following import follow as follow
from .motion.joining import join as join
from .motion.joint_path import JointPath as JointPath
from .motion.paths import (
    CircularArc as CircularArc,
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
    resolve as resolve,
    step as step,
)
from .motion.tracking import (
    HandFilter as HandFilter,
    Tracker as Tracker,
    Tracking as Tracking,
)
from .poses import pose as pose
from .reach.placement import place as place
from .reach.reach_map import (
    ReachMap as ReachMap,
    reach_map as reach_map,
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
from .timing.trajectory import Trajectory as Trajectory

__all__: tuple[str, ...]
_HOME: dict[str, str]
