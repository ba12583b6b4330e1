"""``armangle follow``: step along a file of poses."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ..._arrays import CONFIGURATIONS, Floats
from ...arm.offset import OffsetArm
from ...errors import InputError
from ...files.tables import load_poses
from ...motion.following import follow
from ...motion.joint_path import BEGIN, JointPath
from ...motion.options import MAX_JOINT_STEP
from ...motion.policies import Centre, Hold, Policy, Repulsion, Towards
from ...status import STATUSES, Status
from ..arguments import (
    add_arm,
    add_json,
    add_output,
    add_roll,
    add_scene,
    add_singularity_margin,
    add_wish,
    angle_up_to,
    any_arm_and_scene,
    joints,
    number,
    wish,
)
from ..messages import note
from ..screen import counted, degrees, plural, progress, show, show_json, violations, write
from ..tables import paint, table

_POLICIES: dict[str, tuple[Any, tuple[str, ...]]] = {  # and which options each takes
    "repulsion": (Repulsion, ("K", "alpha", "rate")),
    "hold": (Hold, ()),
    "centre": (Centre, ("K", "rate")),
    "towards": (Towards, ("psi", "point", "direction", "K", "rate")),
}
_BEGIN = "the joints that armangle ik --pose (the first) --near (the start) prints"
HELP = """\
Step along a file of poses from given joints: the arm angle keeps off what the
limits block (--policy), limits hold, and no joint jumps. The global
configuration stays but where branches meet: where joint 2 or 6 passes 0."""
EXAMPLE = """\
  armangle follow path.csv --robot kuka_iiwa7_r800 -o joints.csv --alpha 20 \\
      --start -5.4101,-26.4986,-48.1542,-61.65,152.6198,114.4466,8.1812"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("path", metavar="PATH", help="poses with the columns x,y,z,qw,qx,qy,qz")
    parser.add_argument("--start", required=True, metavar="Q", help="q1,..,q7 in degrees, before the path")
    add_output(parser, "joints")
    parser.add_argument("--gc", type=int, choices=range(CONFIGURATIONS), help="default: that of --start")
    add_arm(parser)
    add_scene(parser)
    add_roll(parser)
    _add_policy(parser.add_argument_group("the arm angle"))
    parser.add_argument("--carry", choices=("psi", "elbow"), default="psi", help="what stays between poses")
    parser.add_argument(
        "--max-joint-step", type=angle_up_to(np.inf, positive=True), default=MAX_JOINT_STEP, metavar="DEG",
        help=f"a joint that moves further has jumped (default {np.degrees(MAX_JOINT_STEP):.2f})",
    )  # fmt: skip
    parser.add_argument("--on-fail", choices=("stop", "hold", "skip"), default="stop", help="at a failure")
    add_singularity_margin(parser)
    add_json(parser)


def _add_policy(group: Any) -> None:
    group.add_argument("--policy", choices=tuple(_POLICIES), default="repulsion")
    add_wish(group, "towards: ")
    group.add_argument("--K", type=number, metavar="K", help="strength per pose, 0 to 1 (default 0.1)")
    group.add_argument("--alpha", type=number, metavar="A", help="repulsion: larger is later (default 20)")
    group.add_argument("--rate", type=number, metavar="R", help="--K per second, with --dt")
    group.add_argument("--dt", type=number, metavar="S", help="seconds from pose to pose")
    group.add_argument("--outside", choices=("nearest", "stop"), default="nearest", help="outside all arcs")


def _policy(args: argparse.Namespace) -> Policy:
    options = dict.fromkeys(name for _, takes in _POLICIES.values() for name in takes)
    given = {name: getattr(args, name) for name in options if getattr(args, name) is not None}
    made, takes = _POLICIES[args.policy]
    for name in given.keys() - set(takes):
        raise InputError(f"--{name} does not go with --policy {args.policy}")
    if "K" in given and "rate" in given:
        raise InputError("--K and --rate are one and the same per pose and per second: give one")
    if "rate" in given and args.dt is None:
        raise InputError("--rate is per second: give the time from pose to pose by --dt")
    policy: Policy = made(outside=args.outside, **wish(given))
    return policy


def run(args: argparse.Namespace) -> int:
    """Write the joints and print a summary; status 1 where a pose is not solved."""
    arm, scene = any_arm_and_scene(args)
    start = joints("--start", args.start)
    if not arm.within_limits(start):
        raise InputError(f"--start is outside the limits: {violations(arm, start)}")
    policy = _policy(args)
    with progress(f"reading {args.path}"):
        frames = load_poses(args.path)
    with progress(f"stepping along {counted(len(frames), 'pose')}"):
        path = follow(
            arm, frames, start=start, gc=args.gc, policy=policy, dt=args.dt, carry=args.carry,
            max_joint_step=args.max_joint_step, singularity_margin=args.singularity_margin,
            on_fail=args.on_fail, scene=scene, roll=args.roll,
        )  # fmt: skip
    if args.output is not None:
        write(path, args.output)
    facts = _summary(path, start)
    if args.json:
        freed = {"free_joint": arm.free_joint} if isinstance(arm, OffsetArm) else {}
        show_json(facts | freed | {"policy": repr(policy), "output": args.output})
    else:
        _show(path, facts)
    if not path.ok:
        note(f"armangle: {path.explain().replace(BEGIN, _BEGIN)}")
    return 0 if path.ok else 1


def _summary(path: JointPath, start: Floats) -> dict[str, Any]:
    solved = path.status == Status.OK
    moved = np.abs(np.diff(np.vstack([start, path.q[solved]]), axis=0)).max(axis=1)
    psi = path.psi[solved]
    counts = {s.name: int((path.status == s).sum()) for s in STATUSES if (path.status == s).any()}
    return {
        "poses": len(path),
        "status": counts,
        "psi": psi[[0, -1]] if len(psi) else np.full(2, np.nan),
        "margin": float(path.margin[solved].min()) if len(psi) else float("nan"),
        "largest_step": float(moved.max(initial=0.0)),
        "first_failure": path.first_failure,
        "explanation": path.explain(),
    }


def _show(path: JointPath, facts: dict[str, Any]) -> None:
    first, last = facts["psi"]
    freed = f"joint {path.arm.free_joint}" if isinstance(path.arm, OffsetArm) else "psi"
    rows = [
        ["poses", str(len(path)), ""],
        [f"{freed} first", degrees(first), "deg"],
        [f"{freed} last", degrees(last), "deg"],
        ["least margin to a limit", degrees(facts["margin"]), "deg"],
        ["largest joint step", degrees(facts["largest_step"]), "deg"],
    ]
    rows += [[name, str(count), plural(count, "pose")] for name, count in facts["status"].items()]
    show(table(["", "", ""], rows, left=(0, 2)).split("\n", 1)[1])
    if path.ok:
        show(paint(path.explain(), "green"))
