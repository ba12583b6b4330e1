"""What a newcomer types into the search box, and the page that is to be found first."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sphinx.application import Sphinx

PAGES = {
    "which": ("closest", "closest joints", "nearest posture", "solutions", "inverse kinematics", "IK"),
    "howto/teleoperation": ("teleoperation", "joystick", "hand tracking"),
    "howto/elbow_up": ("elbow up", "elbow"),
    "howto/limits": ("joint limits", "limits", "singularity", "singularities"),
    "howto/moveit": ("ROS 2", "ros2_control"),
    "howto/urdf": ("URDF",),
    "howto/obstacles": ("obstacles", "collision"),
    "howto/realtime": ("control loop", "1 kHz"),
    "coming_from": ("MoveIt", "KDL", "ikpy", "pinocchio", "Robotics Toolbox"),
    "interop": ("ROS", "quaternion", "pose"),
    "faq": ("redundancy", "null space", "gripper", "NaN"),
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
