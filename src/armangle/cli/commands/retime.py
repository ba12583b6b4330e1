"""``armangle retime``: a joint file to a trajectory file."""

from __future__ import annotations

import argparse

import numpy as np

from ..._arrays import JOINTS
from ...arm.arm import Arm
from ...arm.offset import OffsetArm
from ...errors import InputError
from ...files.tables import load_joints
from ...motion.joint_path import BETWEEN
from ...timing.retiming import retime
from ...timing.trajectory import Trajectory
from ..arguments import add_arm, add_json, add_output, any_arm, joint_bounds, number
from ..motions import motion_of
from ..pictures import add_picture, draw
from ..screen import degrees, progress, show, show_json, write
from ..tables import paint, table

HELP = """\
Give a joint file times: as fast as the bounds on the joints allow, from rest
to rest. Bounds are one number, or seven."""
EXAMPLE = """\
  armangle retime joints.csv --robot kuka_iiwa7_r800 --acceleration 300 \\
      -o motion.yaml"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("joints", metavar="JOINTS", help="the columns q1..q7, as plan and follow write them")
    add_output(parser, "trajectory", more=", .yaml (ROS)")
    add_picture(parser, "joints, velocities and accelerations over time")
    add_arm(parser)
    parser.add_argument(
        "--between", choices=BETWEEN,
        help="from row to row: the tool goes straight, or every joint does, as from one taught posture to "
        "another (PTP), or joints are on a spline through the rows, as those of a smooth motion: of plan "
        "--blend; default: spline where rows are smooth, else tool",
    )  # fmt: skip
    bounds = parser.add_argument_group("bounds")
    bounds.add_argument("--velocity", metavar="V", help="of the joints, deg/s; default: the arm's own")
    bounds.add_argument(
        "--acceleration", metavar="A", help="deg/s^2; default: the arm's own, if it states one"
    )
    bounds.add_argument("--jerk", metavar="J", help="deg/s^3; corners are rounded then")
    bounds.add_argument(
        "--tolerance",
        type=number,
        metavar="M",
        help="what the tool may be off there, m (default 0.0001 with --jerk)",
    )
    bounds.add_argument("--tool-speed", type=number, metavar="V", help="constant speed of the tool, m/s")
    parser.add_argument(
        "--sample", type=number, default=0.01, metavar="S", help="time between rows (default 0.01)"
    )
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Write the trajectory and print how long it takes; status 1 where no timing keeps the bounds."""
    arm = any_arm(args)
    velocity = joint_bounds("--velocity", args.velocity, "deg/s", arm.velocity)
    acceleration = joint_bounds("--acceleration", args.acceleration, "deg/s^2", arm.acceleration)
    if np.isinf(acceleration).all():
        raise InputError("--acceleration is missing: the arm states none; wanted deg/s^2")
    jerk = (
        None if args.jerk is None else joint_bounds("--jerk", args.jerk, "deg/s^3", np.full(JOINTS, np.inf))
    )
    with progress(f"reading {args.joints}"):
        rows = load_joints(args.joints)
        path = motion_of(arm, rows, args.between)
    with progress("timing"):
        found = retime(
            path, velocity=velocity, acceleration=acceleration, jerk=jerk, tolerance=args.tolerance,
            tool_speed=args.tool_speed, sample=args.sample,
        )  # fmt: skip
    if args.output is not None:
        write(found, args.output)
    if args.plot is not None:
        draw("trajectory", args.plot, found, velocity=velocity, acceleration=acceleration)
    if args.json:
        facts = {"duration": found.duration, "rows": len(found), "explanation": found.explain()}
        facts |= {"deviation": found.deviation._asdict()}
        show_json(facts | {"output": args.output, "plot": args.plot})
    else:
        _show(arm, found)
    return 0


def _show(arm: Arm | OffsetArm, found: Trajectory) -> None:
    rows = [
        [str(i + 1), arm.joint_names[i], degrees(np.abs(found.qd[:, i]).max(), 2),
         degrees(np.abs(found.qdd[:, i]).max(), 2)]
        for i in range(JOINTS)
    ]  # fmt: skip
    show(table(["joint", "name", "fastest deg/s", "hardest deg/s^2"], rows, left=(1,)))
    show(paint(f"{len(found)} rows. {found.explain()}", "green"))
