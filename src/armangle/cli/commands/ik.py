"""``armangle ik``: joints of a pose: the nearest, all, those of an arm angle, or the feasible intervals."""

from __future__ import annotations

import argparse
from dataclasses import asdict

import numpy as np

from ... import kuka
from ..._arrays import JOINTS, Floats, number_in
from ...arm.arm import Arm
from ...arm.question import METRICS
from ...errors import InputError
from ...files.tables import load_joints
from ..arguments import add, add_arm, add_scene, given, is_file, joints, poses, refuse, some_joints
from ..intervals import EVERY, draw_map, show_intervals
from ..loading import srs, with_scene
from ..messages import note, paragraph
from ..motions import motion_of
from ..pictures import draw
from ..screen import show, show_configuration, show_json, violations
from ..solving import Asked, forward, solve, solve_all, solve_at_psi
from ..tables import paint

HELP = """\
Joints of a pose. Without --psi: the solution nearest to --seed, of all
branches, arm angles and turns. With --psi and --gc: the one that they define.
--intervals shows the arm angles that keep all joints within their limits.
The joint limits always hold: outside them there is no solution."""
EXAMPLE = """\
  armangle ik --robot kuka_iiwa7_r800 --pose 0.4,0.1,0.6,0,1,0,0 \\
      --seed 0,20,0,-60,0,60,0
  armangle ik --robot kuka_iiwa7_r800 --intervals \\
      --joints -5.4101,-26.4986,-48.1542,-61.65,152.6198,114.4466,8.1812"""


_FREE = ("metric", "fallback", "roll")
_NOT_WITH = {
    "kuka": (*_FREE, "scene", "psi", "gc", "all", "explain", "intervals", "singularity-margin", "output",
             "plot"),
    "intervals": (*_FREE, "seed", "output"),
    "explain": (*_FREE, "psi", "seed", "gc", "output", "plot"),
    "psi": (*_FREE, "scene", "singularity-margin"),
    "all": ("fallback", "roll", "output", "plot"),
}  # fmt: skip
"""Options that have no effect in each mode."""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle ik` to its parser."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument(
        "--pose", metavar="POSE", help="x,y,z,qw,qx,qy,qz (m, unit quaternion), or a FILE of poses"
    )
    where.add_argument(
        "--kuka", metavar="FRAME",
        help="X,Y,Z,A,B,C,E1,Status[,Turn] of a KUKA, mm and degrees: E1 and Status choose the solution",
    )  # fmt: skip
    add(
        where, "joints", help="the pose, and with --intervals the branch, of q1,..,q7 in degrees or of a FILE"
    )
    parser.add_argument(
        "--seed",
        metavar="Q",
        help="q1,..,q7 in degrees: the present joints (default: the middle of the ranges)",
    )
    parser.add_argument(
        "--metric", choices=[*METRICS],
        help="distance to --seed: root of the sum of squares, or largest move (default l2)",
    )  # fmt: skip
    parser.add_argument(
        "--fallback",
        choices=("nearest_pose",),
        help="if the pose is unreachable, solve the nearest reachable one",
    )
    add(parser, "psi", "gc", "roll", "singularity-margin")
    which = parser.add_mutually_exclusive_group()
    which.add_argument(
        "--all", action="store_true", help="a solution of each branch and interval, or of --psi"
    )
    which.add_argument("--explain", action="store_true", help="which branches hold the pose; if none, why")
    which.add_argument(
        "--intervals", nargs="?", const=0, type=_joint, metavar="JOINT",
        help="feasible intervals of the arm angle; of one joint 1..7 alone, or of each joint: joints",
    )  # fmt: skip
    add_arm(parser)
    add_scene(parser)
    add(parser, "output")
    add(parser, "plot", help="draw the joints over the arm angle, with --scene the clearance, with "
        "--intervals the circle, or of a FILE the map: .png, .svg or .pdf")  # fmt: skip
    add(parser, "json")


def _joint(text: str) -> int:
    """Return a joint 1..7, or `EVERY`, for argparse."""
    if text == "joints":
        return EVERY
    if text not in map(str, range(1, JOINTS + 1)):
        raise argparse.ArgumentTypeError(f"{text!r} is no joint, wanted 1..7 or joints")
    return int(text)


def run(args: argparse.Namespace) -> int:
    """Print the requested solutions of the pose; status 1 if there is none."""
    arm = with_scene(args)
    for mode in given(args, _NOT_WITH):
        if mode != "psi" or args.intervals is None:
            refuse(args, _NOT_WITH[mode], f"--{mode}")
    if args.kuka is not None:
        return _kuka(srs(arm, "--kuka"), args)
    if args.intervals is not None and args.joints is not None and is_file(args.joints):
        return draw_map(motion_of(arm, load_joints(args.joints)), args)
    asked = _asked(arm, args)
    if args.intervals is not None:
        if asked.frame.ndim == 3:
            return draw_map((arm, asked.frame), args)
        return show_intervals(asked, args)
    if args.explain:
        return _explain(arm, asked.frame, args)
    if asked.frame.ndim == 3 and (args.all or args.plot is not None):
        raise InputError(f"--{'all' if args.all else 'plot'} takes one pose, and there is a file of poses")
    if args.psi is not None:
        if args.gc is None and not args.all:
            raise InputError("--psi needs --gc or --all; without --psi ik finds the nearest solution")
        status, found = solve_at_psi(asked, args)
    elif args.all:
        status, found = solve_all(asked, args)
    else:
        status, found = solve(asked, args)
    if args.plot is not None and found is not None:
        psi, gc = found
        picture = "joint_profiles" if arm.scene is None else "clearance_profile"
        draw(picture, args.plot, arm, asked.frame, gc, psi=psi)
    return status


def _asked(arm: Arm, args: argparse.Namespace) -> Asked:
    """Return the pose of --pose or --joints with seed, branch and arm angle."""
    seed = None if args.seed is None else joints("--seed", args.seed, arm)
    if args.joints is None:
        return Asked(arm, poses("--pose", args.pose), seed, args.gc, args.psi)
    if is_file(args.joints):
        return Asked(arm, forward(arm, some_joints(args.joints))[0], seed, args.gc, None)
    q = joints("--joints", args.joints)
    frame, psi, own = forward(arm, q)
    gc = int(own) if args.gc is None and args.intervals is not None else args.gc
    wanted = args.psi if args.psi is not None or np.isnan(psi) else float(psi)
    return Asked(arm, frame, seed, gc, wanted)


def _kuka(arm: Arm, args: argparse.Namespace) -> int:
    """Print the joints of a KUKA's frame; status 1 if they are outside their limits."""
    words = args.kuka.split(",")
    if len(words) not in (8, 9):
        raise InputError(f"--kuka holds {len(words)} numbers, wanted X,Y,Z,A,B,C,E1,Status or these and Turn")
    try:
        values = np.array([number_in(word) for word in words[:7]])
        codes = [int(word) for word in words[7:]]
    except ValueError:
        raise InputError(f"--kuka is {args.kuka!r}, wanted numbers; Status and Turn are integers") from None
    tool = kuka.pose(values[:3] / 1e3, np.radians(values[3:6]))
    seed = None if args.seed is None else joints("--seed", args.seed)
    e1 = float(np.radians(values[6]))
    if len(codes) == 2:
        q = kuka.from_frame(arm, kuka.KukaFrame(tool, e1, *codes), seed=seed)
    else:
        q = kuka.from_e1(arm, tool, e1, codes[0], seed=seed)
    _, psi, gc = arm.forward(q, on_error="nan")
    frame = kuka.to_frame(arm, q)
    inside = bool(arm.within_limits(q))
    if args.json:
        show_json({"q": q, "psi": psi, "gc": gc, "turn": frame.turn, "within_limits": inside})
    else:
        show_configuration(arm, q, float(psi), int(gc))
        show(f"{paint('KUKA', 'bold')}    {kuka.text(frame)}")
    if not inside:
        note(f"armangle: outside its limits: {violations(arm, q)}")
    return 0 if inside else 1


def _explain(arm: Arm, frame: Floats, args: argparse.Namespace) -> int:
    """Print for every branch whether it reaches the pose; status 1 if none does."""
    if frame.ndim == 3:
        raise InputError("--explain takes one pose")
    diagnosis = arm.explain(frame)
    if args.json:
        branches = [asdict(branch) for branch in diagnosis.branches]
        nearest = {"nearest": diagnosis.nearest, "nearest_gap": diagnosis.nearest_gap}
        instead = None if diagnosis.instead is None else diagnosis.instead._asdict()
        show_json({"ok": diagnosis.ok, "branches": branches} | nearest | {"instead": instead})
    else:
        show(paragraph(diagnosis.explain()))
    return 0 if diagnosis.ok else 1
