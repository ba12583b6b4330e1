"""``armangle plan``: a whole file of poses at once, or step by step with --policy."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

import numpy as np

from ..._arrays import Floats
from ...arm.arm import Arm
from ...errors import InputError
from ...files.tables import load_poses
from ...motion.following import follow
from ...motion.joint_path import BEGIN, LEAST_STEP, JointPath
from ...motion.planning import Objective, plan
from ...motion.policies import Centre, Hold, Policy, Repulsion, Towards
from ...status import STATUSES, Status
from ..arguments import (
    DEGREE,
    add,
    add_arm,
    add_scene,
    angle,
    joint_bounds,
    joints,
    number,
    numbers,
    refuse,
    some_poses,
    start_joints,
    within,
)
from ..loading import with_scene
from ..messages import note, paragraph
from ..pictures import draw
from ..screen import (
    counted,
    degrees,
    plural,
    progress,
    redundancy_name,
    show,
    show_json,
    write,
)
from ..tables import paint, table

HELP = """\
Plan a whole file of poses at once: the best global configuration and arm angle,
collision-free, with the limits proven between the poses too; or the reason why
not. With --policy: step along the poses from --start instead."""
EXAMPLE = """\
  armangle plan path.csv --robot kuka_iiwa7_r800 -o joints.csv
  armangle plan path.csv --robot kuka_iiwa7_r800 --policy repulsion,alpha=20 \\
      --start -5.4101,-26.4986,-48.1542,-61.65,152.6198,114.4466,8.1812"""

_FAR = np.radians(11.5)
"""If a joint moves more than this between rows, the end effector visibly leaves its path."""
_BEGIN = "the joints that armangle ik --pose (the first) --seed (the start) prints"
_POLICIES: dict[str, tuple[Any, tuple[str, ...]]] = {  # with the settings of each
    "repulsion": (Repulsion, ("K", "alpha", "rate", "outside")),
    "hold": (Hold, ("outside",)),
    "centre": (Centre, ("K", "rate", "outside")),
    "towards": (Towards, ("K", "rate", "outside")),
}
_CHOICES = {"outside": ("nearest", "stop"), "carry": ("psi", "elbow"), "on_fail": ("stop", "hold", "skip")}


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle plan` to its parser."""
    parser.add_argument("path", metavar="PATH", help="poses with the columns x,y,z,qw,qx,qy,qz")
    add(parser, "start")
    parser.add_argument("--goal", metavar="Q", help="q1,..,q7 in degrees: the joints at the last pose")
    add(parser, "gc")
    add(parser, "psi", type=None, metavar="WISH", help="wish of the arm angle: DEG, or the elbow up, down, "
        "left, ..., direction:x,y,z, or point:x,y,z (m)")  # fmt: skip
    parser.add_argument(
        "--policy", metavar="NAME[,KEY=VALUE]",
        help="step along the poses: repulsion, hold, centre, or towards (--psi); keys: K (strength per pose, "
        "0.1), alpha (20), rate (K per second) and dt (s), outside=nearest or stop, carry=psi or elbow, "
        "on_fail=stop, hold or skip",
    )  # fmt: skip
    add(parser, "roll", "singularity-margin")
    parser.add_argument(
        "--limit-margin", type=within(180.0, DEGREE, "deg"), metavar="DEG",
        help="distance to every joint limit (default 0)",
    )  # fmt: skip
    parser.add_argument(
        "--samples", type=int, metavar="N", help="number of rows, evenly along the path (default: the poses)"
    )
    parser.add_argument(
        "--step", type=within(360.0, DEGREE, "deg", positive=True), metavar="DEG",
        help="largest move of a joint from row to row: adds rows; with --policy a larger move fails",
    )  # fmt: skip
    parser.add_argument(
        "--blend", type=within(1e3, 1e-3, "mm"), metavar="MM",
        help="round the corners at the poses, from this far before to this far after; writes 200 rows, and "
        "more if a joint moved more than 11.5 deg",
    )  # fmt: skip
    parser.add_argument(
        "--duration", type=number, metavar="WEIGHT",
        help="weight of the duration against joint travel and margins, say 100 (default 0)",
    )  # fmt: skip
    add(parser, "acceleration")
    add_arm(parser)
    add_scene(parser)
    add(parser, "output")
    add(parser, "plot", help="draw the arm angle and the joints along the path: .png, .svg or .pdf")
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Print a summary, write joints to --output; status 1 and the reason if a pose has no solution."""
    arm = with_scene(args)
    path, facts = (_plan if args.policy is None else _step)(arm, args)
    if args.output is not None:
        write(path, args.output)
    if args.plot is not None:
        draw("path", args.plot, path)
    if args.json:
        show_json(facts | {"redundancy": arm.redundancy, "output": args.output, "plot": args.plot})
    else:
        _show(path, facts)
    if not path.ok:
        note(f"armangle: {path.explain().replace(BEGIN, _BEGIN)}")
    return 0 if path.ok else 1


def _plan(arm: Arm, args: argparse.Namespace) -> tuple[JointPath, dict[str, Any]]:
    """Return the joint path of `plan` with the options in `args` (not ok if there is none), and the facts to
    print. Raise if an option is invalid.
    """
    start = None if args.start is None else joints("--start", args.start, arm)
    goal = None if args.goal is None else joints("--goal", args.goal, arm)
    margin = args.limit_margin or 0.0
    narrowest = float((arm.upper - arm.lower).min())
    if 2 * margin > narrowest:
        most = f"{degrees(narrowest / 2, 2)}: half of the narrowest range"
        raise InputError(f"--limit-margin is {degrees(margin, 2)} deg, wanted at most {most}")
    if args.step is not None and args.step < LEAST_STEP:
        least = f"{np.degrees(LEAST_STEP):.1g} deg"
        raise InputError(f"--step is {np.degrees(args.step):g} deg, wanted at least {least}")
    objective = Objective(duration=args.duration or 0.0, acceleration=_acceleration(arm, args))
    wished = None if args.psi is None else Towards(**_wish(args.psi))
    frames = some_poses(args.path)
    with progress(f"planning {counted(len(frames), 'pose')}"):
        path = plan(
            arm, frames, blend=args.blend or 0.0, start=start, goal=goal, gc=args.gc, psi=wished,
            limit_margin=margin, roll=args.roll, objective=objective, samples=args.samples,
        )  # fmt: skip
    if args.step is not None and path.ok:
        path = path.finer(args.step)
    ranking = path.diagnosis.branches if path.diagnosis is not None else ()
    proven = {"certified": path.certified, "uncertified": path.uncertified}
    return path, _facts(path, path.q[:1]) | proven | {"branches": [asdict(branch) for branch in ranking]}


def _step(arm: Arm, args: argparse.Namespace) -> tuple[JointPath, dict[str, Any]]:
    """Return the path that --policy produces pose by pose, not ok if it stops, and the facts to print."""
    refuse(args, ("goal", "limit-margin", "samples", "blend", "duration", "acceleration"), "--policy")
    if args.start is None:
        raise InputError("--policy needs --start, the joints before the first pose")
    start = start_joints(args.start, arm)
    policy, options = _policy(args)
    with progress(f"reading {args.path}"):
        frames = load_poses(args.path)
    with progress(f"stepping along {counted(len(frames), 'pose')}"):
        path = follow(
            arm, frames, start=start, gc=args.gc, policy=policy, max_joint_step=args.step, roll=args.roll,
            **options,
        )  # fmt: skip
    return path, _facts(path, start[None]) | {"policy": repr(policy)}


def _policy(args: argparse.Namespace) -> tuple[Policy, dict[str, Any]]:
    """Return the policy of --policy, and its options for stepping."""
    name, *settings = args.policy.split(",")
    if name not in _POLICIES:
        raise InputError(f"--policy is {name!r}, wanted one of {', '.join(_POLICIES)}")
    made, takes = _POLICIES[name]
    keys = (*takes, "dt", "carry", "on_fail")
    given: dict[str, Any] = {}
    for setting in settings:
        key, _, value = setting.partition("=")
        if key not in keys:
            raise InputError(f"--policy {name} has no {key!r}, wanted one of {', '.join(keys)}")
        given[key] = _setting(key, value)
    if "K" in given and "rate" in given:
        raise InputError("--policy: K per pose and rate per second are the same: give one")
    if "rate" in given and "dt" not in given:
        raise InputError("--policy: rate is per second: give the time from pose to pose, dt")
    if name != "towards":
        refuse(args, ("psi",), f"--policy {name}")
    elif args.psi is None:
        raise InputError("--policy towards needs a wish of the arm angle: --psi")
    wish = {} if args.psi is None else _wish(args.psi)
    policy: Policy = made(**{key: value for key, value in given.items() if key in takes}, **wish)
    return policy, {key: value for key, value in given.items() if key not in takes}


def _setting(key: str, text: str) -> Any:
    """Return the value of a setting of --policy."""
    if key in _CHOICES:
        if text not in _CHOICES[key]:
            raise InputError(f"--policy: {key} is {text!r}, wanted {' or '.join(_CHOICES[key])}")
        return text
    try:
        return number(text)
    except argparse.ArgumentTypeError as error:
        raise InputError(f"--policy: {key}: {error}") from None


def _wish(text: str) -> dict[str, Any]:
    """Return the target of --psi by its keyword of `plan`: psi (rad), a point (m), or a direction.
    The text is DEG, a word such as up (not checked here), direction:x,y,z or point:x,y,z.
    """
    kind, colon, value = text.strip().partition(":")
    if colon:
        if kind not in ("direction", "point"):
            raise InputError(f"--psi is {text!r}, wanted DEG, up, down, ..., direction:x,y,z or point:x,y,z")
        return {kind: numbers(f"--psi {kind}", value, "x,y,z", 3)}
    try:
        return {"psi": angle(text)}
    except argparse.ArgumentTypeError:
        return {"direction": kind}


def _acceleration(arm: Arm, args: argparse.Namespace) -> Floats | None:
    """Return the bounds of --acceleration or None, and print a note if --duration has velocities alone."""
    if args.acceleration is not None:
        if not args.duration:
            raise InputError("--acceleration goes with --duration")
        return joint_bounds("--acceleration", args.acceleration, "deg/s^2", arm.acceleration)
    if args.duration and np.isinf(arm.acceleration).all():
        note(
            "armangle: the arm states no accelerations: --duration counts with speeds, or give --acceleration"
        )
    return None


def _facts(path: JointPath, start: Floats) -> dict[str, Any]:
    """Return numbers about a path for JSON: poses by status, branch, arm angles and largest joint
    step (rad).
    """
    solved = path.status == Status.OK
    psi = path.psi[solved]
    moved = np.abs(np.diff(np.vstack([start, path.q[solved]]), axis=0))
    return {
        "poses": len(path),
        "status": {s.name: int((path.status == s).sum()) for s in STATUSES if (path.status == s).any()},
        "gc": int(path.gc[0]) if len(path) else -1,
        "psi": psi[[0, -1]] if len(psi) else np.full(2, np.nan),
        "margin": float(path.margin[solved].min()) if solved.any() else float("nan"),
        "largest_step": float(moved.max(initial=0.0)),
        "first_failure": path.first_failure,
        "explanation": path.explain(),
    }


def _show(path: JointPath, facts: dict[str, Any]) -> None:
    """Print the facts about a path as a table."""
    planned = "certified" in facts
    first, last = facts["psi"]
    rows = [
        ["poses", str(len(path)), ""],
        ["global configuration", str(facts["gc"]), ""],
        [f"{redundancy_name(path.arm)} first", degrees(first), "deg"],
        [f"{redundancy_name(path.arm)} last", degrees(last), "deg"],
        ["least margin to a limit", degrees(facts["margin"]), "deg"],
        ["largest joint step", degrees(facts["largest_step"]), "deg"],
        *([["proven between the poses", "yes" if facts["certified"] else "no", ""]] if planned else []),
        *([name, str(count), plural(count, "pose")] for name, count in facts["status"].items()),
    ]
    show(table(["", "", ""], rows, left=(0, 2)).split("\n", 1)[1])
    if not path.ok:
        return
    show(paint(paragraph(facts["explanation"]), "green"))
    for low, high in np.asarray(facts["uncertified"]) if planned else ():
        show(f"not proven from s = {low:.6g} to {high:.6g}")
    if planned and facts["largest_step"] > _FAR:
        note("armangle: joints move far from row to row, and the tool leaves its path: --step 1 adds rows")
