"""Files: joint tables, poses, motions, scenes, collision models, point clouds and distance fields."""

from .files.clouds import load_cloud
from .files.fields import load_field
from .files.scenes import load_body, load_scene
from .files.tables import JointTable, load_joints, load_poses, save
from .files.trajectories import TrajectoryTable, load_trajectory

__all__ = [
    "JointTable",
    "TrajectoryTable",
    "load_body",
    "load_cloud",
    "load_field",
    "load_joints",
    "load_poses",
    "load_scene",
    "load_trajectory",
    "save",
]
