"""``armangle plan``: a whole file of poses at once."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from typing import Any

import numpy as np

from ..._arrays import CONFIGURATIONS, Floats
from ...arm.arm import Arm
from ...errors import InputError
from ...motion.joint_path import LEAST_STEP, JointPath
from ...motion.planning import Objective, plan
from ...motion.policies import Towards
from ...status import Status
from ..arguments import (
    add_arm,
    add_json,
    add_output,
    add_roll,
    add_scene,
    add_singularity_margin,
    add_wish,
    angle_up_to,
    joint_bounds,
    joints,
    length_up_to,
    number,
    some_poses,
    the_arm,
    wish,
    with_body,
)
from ..messages import note, paragraph
from ..screen import counted, degrees, plural, progress, show, show_json, write
from ..tables import paint, table

HELP = """\
Plan a whole file of poses at once: the best global configuration and arm
angle, proven to keep the limits between the poses too, and clear of obstacles;
or the reason why not."""
_FAR = np.radians(11.5)
"""A joint that moves by more from row to row takes the tool visibly off its path."""
EXAMPLE = """\
  armangle plan path.csv --robot kuka_iiwa7_r800 -o joints.csv"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument("path", metavar="PATH", help="poses with the columns x,y,z,qw,qx,qy,qz")
    parser.add_argument("--start", metavar="Q", help="q1,..,q7 in degrees at the first pose")
    parser.add_argument("--goal", metavar="Q", help="the same at the last pose")
    add_output(parser, "joints")
    parser.add_argument(
        "--gc", type=int, choices=range(CONFIGURATIONS), help="default: the best of all eight"
    )
    add_arm(parser)
    add_singularity_margin(parser)
    parser.add_argument(
        "--limit-margin", type=angle_up_to(np.pi), default=0.0, metavar="DEG",
        help="kept from every limit (default 0)",
    )  # fmt: skip
    add_roll(parser)
    parser.add_argument(
        "--samples", type=int, metavar="N",
        help="rows of joints, evenly along the path, at least 2 (default: one for each pose of the file)",
    )  # fmt: skip
    parser.add_argument(
        "--step", type=angle_up_to(2 * np.pi, positive=True), metavar="DEG",
        help="add rows between, until no joint moves more than this from one to the next",
    )  # fmt: skip
    parser.add_argument(
        "--blend", type=length_up_to(1.0), default=0.0, metavar="MM",
        help="round the corners at the poses, from this far before to this far behind; the rows are 200 "
        "then, and more where a joint would move more than 11.5 deg",
    )  # fmt: skip
    parser.add_argument(
        "--duration", type=number, default=0.0, metavar="WEIGHT",
        help="of the time it takes beside joint travel and margins, say 100 (default 0)",
    )  # fmt: skip
    parser.add_argument(
        "--acceleration", metavar="A",
        help="of the joints, deg/s^2, that --duration counts with; default: the arm's own, if it states one",
    )  # fmt: skip
    add_scene(parser)
    add_wish(parser.add_argument_group("what is wished of the arm angle"))
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Write the joints and print a summary; status 1 and the explanation where there is no way."""
    arm, scene = with_body(the_arm(args), args)
    start = None if args.start is None else joints("--start", args.start, arm)
    goal = None if args.goal is None else joints("--goal", args.goal, arm)
    _check_limit_margin(arm, args.limit_margin)
    if args.step is not None and args.step < LEAST_STEP:
        least = f"{np.degrees(LEAST_STEP):.1g} deg"
        raise InputError(f"--step is {np.degrees(args.step):g} deg, wanted at least {least}")
    objective = Objective(duration=args.duration, acceleration=_acceleration(arm, args))
    given = {name: getattr(args, name) for name in ("psi", "point", "direction")}
    given = {name: value for name, value in given.items() if value is not None}
    wished = Towards(**wish(given)) if given else None
    frames = some_poses(args.path)
    with progress(f"planning {counted(len(frames), 'pose')}"):
        path = plan(
            arm, frames, blend=args.blend, start=start, goal=goal, gc=args.gc,
            singularity_margin=args.singularity_margin, limit_margin=args.limit_margin, psi=wished,
            scene=scene, roll=args.roll, objective=objective, samples=args.samples,
        )  # fmt: skip
    if args.step is not None and path.ok:
        path = path.finer(args.step)
    if args.output is not None:
        write(path, args.output)
    facts = _summary(path)
    if args.json:
        show_json(facts | {"output": args.output})
    else:
        _show(path, facts)
    if not path.ok:
        note(f"armangle: {path.explain()}")
    return 0 if path.ok else 1


def _acceleration(arm: Arm, args: argparse.Namespace) -> Floats | None:
    """Return what duration counts with, and say so where that is speeds alone."""
    if args.acceleration is not None:
        if not args.duration > 0:
            raise InputError("--acceleration is of --duration, which is not given")
        return joint_bounds("--acceleration", args.acceleration, "deg/s^2", arm.acceleration)
    if args.duration > 0 and np.isinf(arm.acceleration).all():
        note("armangle: the arm states no accelerations: duration is of speeds alone without --acceleration")
    return None


def _check_limit_margin(arm: Arm, margin: float) -> None:
    """Refuse in degrees what `plan` would refuse in radians."""
    narrowest = float((arm.upper - arm.lower).min())
    if 2 * margin > narrowest:
        most = f"{degrees(narrowest / 2, 2)}: half of the narrowest range"
        raise InputError(f"--limit-margin is {degrees(margin, 2)} deg, wanted at most {most}")


def _summary(path: JointPath) -> dict[str, Any]:
    solved = path.status == Status.OK
    ranking = path.diagnosis.branches if path.diagnosis is not None else ()
    return {
        "poses": len(path),
        "reached": int(solved.sum()),
        "gc": int(path.gc[0]) if len(path) else -1,
        "certified": path.certified,
        "uncertified": path.uncertified,
        "margin": float(path.margin[solved].min()) if solved.any() else float("nan"),
        "largest_step": float(np.abs(np.diff(path.q[solved], axis=0)).max(initial=0.0)),
        "branches": [asdict(branch) for branch in ranking],
        "explanation": path.explain(),
    }


def _show(path: JointPath, facts: dict[str, Any]) -> None:
    rows = [
        ["poses", str(len(path)), ""],
        ["reached", str(facts["reached"]), plural(facts["reached"], "pose")],
        ["global configuration", str(facts["gc"]), ""],
        ["least margin to a limit", degrees(facts["margin"]), "deg"],
        ["largest joint step", degrees(facts["largest_step"]), "deg"],
        ["proven between the poses", "yes" if path.certified else "no", ""],
    ]
    show(table(["", "", ""], rows, left=(0, 2)).split("\n", 1)[1])
    if path.ok:
        show(paint(paragraph(path.explain()), "green"))
        for low, high in np.asarray(facts["uncertified"]):
            show(f"not proven from s = {low:.6g} to {high:.6g}")
        if facts["largest_step"] > _FAR:
            note("armangle: joints go far from row to row, and the tool off its path: --step 1 adds rows")
