"""``armangle plot``: pictures of the circle, the joints over the arm angle, a motion, a feasible map."""

from __future__ import annotations

import argparse
from typing import Any

from ..._arrays import CONFIGURATIONS, Floats
from ...arm.arm import Arm
from ...errors import InputError, ModelError
from ...files.tables import load_joints, load_poses
from ...motion.joint_path import JointPath
from ...scenes.scene import Scene
from ..arguments import (
    POSE_HELP,
    add_arm,
    add_json,
    add_scene,
    add_singularity_margin,
    angle,
    joints,
    pose,
    the_arm,
    with_body,
)
from ..messages import note
from ..motions import motion_of
from ..pictures import drawing, write_picture
from ..screen import progress, show_json

HELP = """\
Draw a picture into a file:
  circle    the redundancy circle at a pose: which joint blocks which arm angle
  profiles  the joints over the arm angle at a pose, with their limits
  path      arm angle and joints along a motion: a joint FILE (see follow)
  distance  how near the links come to a --scene, over the arm angle at a pose
  map       feasible arm angles along a motion or along poses: a FILE of either"""
EXAMPLE = """\
  armangle plot circle --robot kuka_iiwa7_r800 -o circle.png \\
      --q -5.4101,-26.4986,-48.1542,-61.65,152.6198,114.4466,8.1812"""

_OF_A_POSE = ("circle", "profiles", "distance")
_WITH_SCENE = ("circle", "distance", "map")


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("picture", choices=(*_OF_A_POSE, "path", "map"), help="what to draw")
    parser.add_argument("file", nargs="?", metavar="FILE", help="path, map: joints or poses")
    parser.add_argument("-o", "--output", required=True, metavar="FILE", help=".png, .svg or .pdf")
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--pose", metavar="POSE", help=f"circle, profiles, distance: {POSE_HELP}")
    where.add_argument("--q", metavar="Q", help="the pose, psi and gc of joints q1,..,q7 in degrees")
    parser.add_argument(
        "--gc", type=int, choices=range(CONFIGURATIONS), help="global configuration; map: all by default"
    )
    parser.add_argument("--psi", type=angle, metavar="DEG", help="arm angle to mark; that of --q by default")
    add_arm(parser)
    add_scene(parser)
    add_singularity_margin(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Draw and write the picture."""
    _check(args)
    arm, scene = with_body(the_arm(args), args)
    plt = drawing()
    from ... import plots

    shown: JointPath | tuple[Arm, Floats] | None = None
    with progress(f"drawing {args.output}"):
        if args.picture in _OF_A_POSE:
            axes = _pose_picture(plots, arm, args, scene)
        elif args.picture == "path":
            shown = _motion(arm, args.file)
            axes = plots.path(shown)
        else:
            shown = _motion_or_poses(arm, args.file)
            margin = args.singularity_margin
            axes = plots.feasible_map(shown, gc=args.gc, singularity_margin=margin, scene=scene)
        write_picture(axes, args.output)
    plt.close("all")
    if args.json:
        show_json({"picture": args.picture, "robot": arm.name, "output": args.output})
    else:
        note(f"wrote {args.output}")
    if isinstance(shown, JointPath) and not shown.ok:
        note(f"armangle: {args.file}: {shown.explain()}")
    return 0


def _check(args: argparse.Namespace) -> None:
    """Refuse arguments that do not go with the picture."""
    if args.scene is not None and args.picture not in _WITH_SCENE:
        raise InputError(f"--scene does not go with plot {args.picture}")
    if args.picture == "distance" and args.scene is None:
        raise InputError("plot distance needs --scene, and the shape of the links: --body")
    if args.picture in _OF_A_POSE:
        if args.pose is None and args.q is None:
            raise InputError(f"plot {args.picture} needs --q, or --pose with --gc")
        if args.pose is not None and args.gc is None:
            raise InputError("--pose needs --gc: a pose alone does not say which configuration to draw")
        if args.file is not None:
            raise InputError(f"plot {args.picture} takes no file, but {args.file!r} is given")
        return
    if args.file is None:
        raise InputError(f"plot {args.picture} needs a file of joints{' or poses' * (args.picture == 'map')}")
    for option in ("pose", "q", "psi"):
        if getattr(args, option) is not None:
            raise InputError(f"--{option} does not go with plot {args.picture}")


def _pose_picture(plots: Any, arm: Arm, args: argparse.Namespace, scene: Scene | None) -> Any:
    gc, psi = args.gc, args.psi
    if args.q is not None:
        frame, own_psi, own_gc = arm.forward(joints("--q", args.q))
        gc = int(own_gc) if gc is None else gc
        psi = float(own_psi) if psi is None else psi
    else:
        frame = pose("--pose", args.pose)
    if args.picture == "circle":
        margin = args.singularity_margin
        return plots.circle(arm, frame, gc, psi=psi, singularity_margin=margin, scene=scene)
    if args.picture == "distance":
        return plots.clearance_profile(arm, frame, gc, scene, psi=psi)
    return plots.joint_profiles(arm, frame, gc, psi=psi)


def _motion(arm: Arm, file: str) -> JointPath:
    return motion_of(arm, load_joints(file))


def _motion_or_poses(arm: Arm, file: str) -> JointPath | tuple[Arm, Floats]:
    """Return the motion of a joint file, or the poses of a pose file: whichever it is."""
    try:
        return _motion(arm, file)
    except ModelError as no_joints:
        try:
            return arm, load_poses(file)
        except ModelError as no_poses:
            raise ModelError(
                f"neither joints ({no_joints}) nor poses ({no_poses})", source=file
            ) from None
