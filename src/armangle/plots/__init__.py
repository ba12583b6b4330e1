"""Plots: the arm, its redundancy circle, its joints over the arm angle, its paths.

Every function takes data and ``ax=None`` and returns the axes it drew on; nothing is shown or saved.
Angles are drawn in degrees. Colours are Okabe and Ito's. Needs matplotlib: ``pip install 'armangle[plot]'``.

Examples
--------
>>> import armangle as aa
>>> from armangle import plots
>>> arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
>>> pose, psi, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
>>> plots.circle(arm, pose, gc, psi=psi).figure.savefig("circle.png")  # doctest: +SKIP
"""

from ..colours import JOINT_COLOURS
from .bases import placement
from .figures import arm_frames, stick_figure
from .maps import feasible_map
from .motions import path, repulsion
from .one_pose import circle, clearance_profile, joint_profiles
from .reaches import reach, voxels
from .times import tracking, trajectory
from .virtual import virtual_arm, virtual_plane

__all__ = [
    "JOINT_COLOURS",
    "arm_frames",
    "circle",
    "clearance_profile",
    "feasible_map",
    "joint_profiles",
    "path",
    "placement",
    "reach",
    "repulsion",
    "stick_figure",
    "tracking",
    "trajectory",
    "virtual_arm",
    "virtual_plane",
    "voxels",
]
