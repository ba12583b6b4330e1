"""``armangle retime``: converts a joint file to a trajectory file."""

from __future__ import annotations

import argparse

import numpy as np

from ..._arrays import JOINTS
from ...arm.arm import Arm
from ...errors import InputError
from ...files.tables import load_joints
from ...motion.joint_path import BETWEEN
from ...timing.retiming import retime
from ...timing.trajectory import Trajectory
from ..arguments import add, add_arm, joint_bounds, number
from ..loading import any_arm
from ..motions import motion_of
from ..pictures import draw
from ..screen import progress, show, show_json, show_speeds, write
from ..tables import paint

HELP = """\
Give a joint file times: as fast as the bounds of the joints allow, from rest to
rest. A bound is one number, or seven."""
EXAMPLE = """\
  armangle retime joints.csv --robot kuka_iiwa7_r800 --acceleration 300 \\
      -o motion.yaml"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle retime` to its parser."""
    parser.add_argument("joints", metavar="JOINTS", help="the columns q1..q7, as plan writes them")
    add(parser, "velocity", "acceleration")
    parser.add_argument("--jerk", metavar="J", help="bound of the joints, deg/s^3; rounds corners")
    parser.add_argument(
        "--between", choices=BETWEEN,
        help="motion from row to row: the tool is straight, or the joints are (PTP), or they follow a spline "
        "(default: spline if rows are smooth, else tool)",
    )  # fmt: skip
    parser.add_argument(
        "--tolerance", type=number, metavar="M",
        help="deviation of the tool at a rounded corner, m (default 0.0001 with --jerk)",
    )  # fmt: skip
    parser.add_argument("--tool-speed", type=number, metavar="V", help="constant speed of the tool, m/s")
    parser.add_argument(
        "--sample", type=number, default=0.01, metavar="S", help="s between rows (default 0.01)"
    )
    add_arm(parser)
    add(parser, "output", help="write the trajectory: .csv, .npz, .json, .yaml (ROS)")
    add(parser, "plot", help="draw joints, velocities and accelerations over time: .png, .svg or .pdf")
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Print the trajectory's duration, write it to --output; raise if no timing respects the bounds."""
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


def _show(arm: Arm, found: Trajectory) -> None:
    """Print the fastest velocity and acceleration of each joint, and the duration."""
    show_speeds(arm, np.abs(found.qd).max(axis=0), np.abs(found.qdd).max(axis=0))
    show(paint(f"{len(found)} rows. {found.explain()}", "green"))
