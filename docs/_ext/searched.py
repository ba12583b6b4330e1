"""What a newcomer types into the search box, and the page that is to be found first."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PAGES = {
    "robots": ("Franka", "KUKA", "supported robots"),
    "guides/solve": (
        "closest",
        "closest joints",
        "nearest solution",
        "solutions",
        "inverse kinematics",
        "IK",
        "ikpy",
    ),
    "guides/elbow": (
        "null space",
        "redundancy",
        "redundancy resolution",
        "self-motion",
        "swivel",
        "SEW",
        "elbow",
        "elbow up",
    ),
    "guides/limits": ("joint limits", "limits", "singularity", "singularities"),
    "guides/obstacles": ("obstacles", "collision", "self-collision", "gripper"),
    "guides/paths": ("Cartesian path", "path planning"),
    "guides/timing": ("time-optimal", "jerk"),
    "guides/control_loop": ("teleoperation", "joystick", "hand tracking", "control loop", "1 kHz"),
    "guides/robot_files": ("URDF", "MJCF", "MuJoCo", "DH parameters", "calibrated"),
    "guides/reach": ("workspace", "reachability", "base placement"),
    "guides/kuka": ("E1", "Status and Turn"),
    "guides/ros_cpp": ("ROS", "ROS 2", "ros2_control", "MoveIt", "KDL", "IKFast", "C++"),
    "guides/learning": ("LeRobot", "torch", "JAX"),
    "reference/conventions": ("end effector", "TCP", "quaternion", "pose", "pinocchio"),
    "reference/errors": ("NaN", "status", "error"),
}


def add_index(app: Sphinx, name: str, source: list[str]) -> None:
    """Give a page the words by which it is to be found: main entries of the index (!) come first."""
    if name in PAGES:
        words = ", ".join(f"! {word}" for word in PAGES[name])
        source[0] += f"\n```{{index}} {words}\n```\n"


def setup(app: Sphinx) -> dict[str, bool]:
    """Hook the function above into the build."""
    app.connect("source-read", add_index)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
