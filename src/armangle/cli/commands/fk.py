"""``armangle fk``: joints to pose, arm angle and global configuration."""

from __future__ import annotations

import argparse

import numpy as np

from ... import kuka
from ..._arrays import Floats
from ...arm.arm import Arm
from ...arm.offset import OffsetArm
from ...errors import InputError
from ...files.tables import load_joints
from ...poses import COLUMNS, rows_from_poses
from ..arguments import add_arm, add_json, add_output, any_arm, is_file, joints
from ..messages import note
from ..offset import place_offset
from ..screen import degrees, fixed, head_and_tail, progress, show, show_json, signs_text, violations, write
from ..tables import paint, table

HELP = "Joints to pose, arm angle psi and global configuration gc."
EXAMPLE = """\
  armangle fk --robot kuka_iiwa7_r800 \\
      -5.4101 -26.4986 -48.1542 -61.65 152.6198 114.4466 8.1812"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    parser.add_argument(
        "q", nargs="+", metavar="Q", help="seven joints in degrees, fixed, or a joint FILE in radians"
    )
    add_arm(parser)
    parser.add_argument(
        "--kuka", action="store_true", help="also as a KUKA's frame: X..C (mm, deg), E1, Status, Turn"
    )
    add_output(parser, "poses")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print where joints lead; status 1 where they are outside their limits."""
    arm = any_arm(args)
    file = len(args.q) == 1 and is_file(args.q[0])
    q = load_joints(args.q[0]).q if file else joints("Q", " ".join(args.q))
    if file and not np.isfinite(q).all():
        row = int(np.argmax(~np.isfinite(q).all(axis=1)))
        raise InputError(f"{args.q[0]}: row {row} has no joint values, wanted a motion without gaps")
    if isinstance(arm, OffsetArm):
        return place_offset(arm, q, args)
    with progress("placing the tool"):
        pose, psi, gc = arm.forward(q, undefined="nan")
    within = arm.within_limits(q)
    frames = [kuka.to_frame(arm, row) for row in np.atleast_2d(q)] if args.kuka else []
    if args.output is not None:
        write(pose, args.output)
    if args.json:
        seven = rows_from_poses(pose.reshape(-1, 4, 4)).reshape(*np.shape(psi), len(COLUMNS))
        facts = {"pose": seven, "matrix": pose, "psi": psi, "gc": gc, "within_limits": within}
        codes = [{"e1": f.e1, "status": f.status, "turn": f.turn, "abc": kuka.abc(f.pose)} for f in frames]
        show_json(facts | ({"kuka": codes if file else codes[0]} if codes else {}))
    elif file:
        _show_many(pose, np.asarray(psi), np.asarray(gc), np.asarray(arm.limit_margin(q)))
    else:
        _show_one(arm, q, pose, float(psi), int(gc))
    for frame in frames if not args.json else ():
        show(f"{paint('KUKA', 'bold')}    {kuka.text(frame)}")
    if not np.all(within):
        first = int(np.argmin(np.atleast_1d(within)))
        where = f"row {first}: " if file else ""
        note(f"armangle: outside its limits: {where}{violations(arm, np.atleast_2d(q)[first])}")
    return 0 if np.all(within) else 1


def _show_one(arm: Arm, q: Floats, pose: Floats, psi: float, gc: int) -> None:
    show(paint("pose (m)", "bold"))
    for line in pose:
        show(" ".join(f"{fixed(value, 6):>10}" for value in line))
    show(f"\n{paint(','.join(COLUMNS), 'bold')}")
    show(",".join(fixed(value, 7) for value in rows_from_poses(pose[None])[0]))
    angle = "not defined: the wrist lies on the shoulder" if np.isnan(psi) else f"{degrees(psi)} deg"
    show(f"\n{paint('psi', 'bold')}     {angle}")
    show(f"{paint('gc', 'bold')}      {gc} ({signs_text(gc)})")
    show(f"{paint('margin', 'bold')}  {degrees(float(arm.limit_margin(q)))} deg to the nearest limit")


def _show_many(pose: Floats, psi: Floats, gc: Floats, margin: Floats) -> None:
    rows = [
        [str(i), *(fixed(v, 4) for v in pose[i, :3, 3]), degrees(psi[i]), str(gc[i]), degrees(margin[i])]
        for i in range(len(psi))
    ]
    show(table(["row", "x m", "y m", "z m", "psi deg", "gc", "margin deg"], head_and_tail(rows)))
