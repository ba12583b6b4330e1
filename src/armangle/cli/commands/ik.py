"""``armangle ik``: pose to joints, the nearest of all or those of an arm angle and global configuration."""

from __future__ import annotations

import argparse
from dataclasses import asdict

import numpy as np

from ... import kuka
from ..._arrays import CONFIGURATIONS, Floats, number_in
from ...arm.arm import Arm
from ...arm.offset import OffsetArm
from ...arm.question import METRICS
from ...errors import InputError
from ...motion.joint_path import JointPath, blank_rows, even_parameters
from ...scenes.scene import Scene
from ...status import STATUSES, Status
from ..arguments import (
    POSE_HELP,
    add_arm,
    add_json,
    add_output,
    add_roll,
    add_scene,
    angle,
    any_arm,
    joints,
    poses,
    with_body,
)
from ..messages import note
from ..offset import solve_offset
from ..screen import (
    degrees,
    joint_margins,
    progress,
    show,
    show_json,
    show_many,
    show_posture,
    unsolved_text,
    violations,
    write,
)
from ..solving import solve
from ..tables import paint, table

HELP = """\
Pose to joints: without --psi the posture nearest to --near, of all branches,
arm angles and windings; with --psi and --gc the one posture that they define.
Joint limits are enforced: outside them there is no solution."""
EXAMPLE = """\
  armangle ik --robot kuka_iiwa7_r800 --pose 0.4,0.1,0.6,0,1,0,0 \\
      --near 0,20,0,-60,0,60,0
  armangle ik --robot kuka_iiwa7_r800 --psi 58.5882 --gc 3 \\
      --pose -0.117424,-0.146412,1.020287,0.425538,-0.432663,0.352360,0.712434"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--pose", metavar="POSE", help=f"{POSE_HELP}; or a FILE of poses")
    where.add_argument(
        "--kuka", metavar="FRAME",
        help="X,Y,Z,A,B,C,E1,Status[,Turn] of a KUKA: mm and degrees; E1 and Status choose the posture",
    )  # fmt: skip
    parser.add_argument(
        "--near", metavar="Q",
        help="q1,..,q7 in degrees: the joints to be nearest to; else the middle of the ranges",
    )  # fmt: skip
    parser.add_argument(
        "--metric", choices=[*METRICS], default="l2",
        help="of near: root of the sum of squares, or the largest move (default l2)",
    )  # fmt: skip
    parser.add_argument(
        "--outside", choices=["refuse", "nearest"], default="refuse",
        help="nearest: where a pose cannot be held, that of the nearest that can",
    )  # fmt: skip
    parser.add_argument("--psi", type=angle, metavar="DEG", help="arm angle; needs --gc or --all")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--explain", action="store_true", help="which branches hold the pose, and if not, why")
    which.add_argument("--gc", type=int, choices=range(CONFIGURATIONS), help="global configuration")
    which.add_argument("--all", action="store_true", help="each branch and arc; with --psi all eight")
    add_arm(parser)
    add_scene(parser)
    add_roll(parser)
    parser.add_argument("--seed", metavar="Q", help="with --psi: q1,..,q7 in degrees, take the nearest turns")
    add_output(parser, "joints")
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the posture or postures; status 1 where there is none within the limits."""
    named = any_arm(args)
    if isinstance(named, OffsetArm):
        if args.pose is None:
            raise InputError("--kuka is of S-R-S arms, wanted --pose")
        return solve_offset(named, poses("--pose", args.pose), args)
    arm, scene = with_body(named, args)
    if scene is not None and (args.kuka is not None or args.psi is not None):
        raise InputError("--scene goes without --psi and --kuka: the arm angle is what it decides")
    if args.roll != "pose" and (args.kuka is not None or args.explain):
        raise InputError("--roll free goes without --kuka and --explain, which are of the whole pose")
    if args.kuka is not None:
        return _kuka(arm, args)
    pose = poses("--pose", args.pose)
    if args.explain:
        return _explain(arm, pose, scene, args)
    if args.psi is None:
        return solve(arm, pose, scene, args)
    if args.near is not None or (args.metric, args.outside, args.roll) != ("l2", "refuse", "pose"):
        raise InputError(
            "--near, --metric, --outside, --roll go without --psi, "
            "which leaves nothing to choose but turns: --seed"
        )
    if args.gc is None and not args.all:
        raise InputError("--psi needs --gc or --all; without --psi the nearest posture is found")
    seed = None if args.seed is None else joints("--seed", args.seed)
    if args.all and (pose.ndim == 3 or args.output is not None):
        raise InputError("--all takes one pose and prints it; name a --gc for a file of poses or for -o")
    if args.all:
        return _all(arm, pose, args.psi, seed, args.json)
    with progress("solving"):
        path = _solve(arm, pose.reshape(-1, 4, 4), args.psi, args.gc, seed)
    if args.output is not None:
        write(path, args.output)
    if args.json:
        _show_json(path, pose.ndim == 2)
    elif pose.ndim == 3:
        show_many(path.q, [STATUSES[code].name for code in path.status])
    elif path.ok:
        show_posture(arm, path.q[0], args.psi, args.gc)
    if not path.ok:
        note(f"armangle: {_reason(arm, path, args.psi, args.gc, seed, pose.ndim == 2)}")
    return 0 if path.ok else 1


_NOT_WITH_KUKA = ("near", "psi", "explain", "gc", "all", "output")


def _kuka(arm: Arm, args: argparse.Namespace) -> int:
    """Print the joints of a KUKA's frame; status 1 where they are outside their limits."""
    for option in _NOT_WITH_KUKA:
        if getattr(args, option) not in (None, False):
            raise InputError(f"--{option} does not go with --kuka: E1 and Status choose the posture")
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
    _, psi, gc = arm.forward(q, undefined="nan")
    frame = kuka.to_frame(arm, q)
    inside = bool(arm.within_limits(q))
    if args.json:
        show_json({"q": q, "psi": psi, "gc": gc, "turn": frame.turn, "within_limits": inside})
    else:
        show_posture(arm, q, float(psi), int(gc))
        show(f"{paint('KUKA', 'bold')}    {kuka.text(frame)}")
    if not inside:
        note(f"armangle: outside its limits: {violations(arm, q)}")
    return 0 if inside else 1


def _explain(arm: Arm, pose: Floats, scene: Scene | None, args: argparse.Namespace) -> int:
    """Print for every global configuration whether it holds the pose; status 1 where none does."""
    if pose.ndim == 3 or args.output is not None or args.psi is not None:
        raise InputError("--explain takes one pose, without --psi and -o")
    diagnosis = arm.explain(pose, scene=scene)
    if args.json:
        branches = [asdict(branch) for branch in diagnosis.branches]
        nearest = {"nearest": diagnosis.nearest, "nearest_gap": diagnosis.nearest_gap}
        instead = None if diagnosis.instead is None else diagnosis.instead._asdict()
        show_json({"ok": diagnosis.ok, "branches": branches} | nearest | {"instead": instead})
    else:
        show(diagnosis.explain())
    return 0 if diagnosis.ok else 1


def _solve(arm: Arm, frames: Floats, psi: float, gc: int, seed: Floats | None) -> JointPath:
    """Return one row a pose, each with its status."""
    n = len(frames)
    q = arm.inverse(frames, psi, gc, seed=seed, limits="nan", unreachable="nan")
    solved = np.isfinite(q).all(axis=1)
    # A pose that is solved at no arm angle says so itself; at another one, this arm angle is outside.
    rows = blank_rows(n)
    why = np.asarray(arm.feasible(frames[~solved], gc).status)
    rows["status"][~solved] = np.where(why == Status.OK, Status.OUTSIDE, why)
    if arm.chain is not None:
        held = np.isfinite(arm.inverse(frames, psi, gc, seed=seed, unreachable="nan")).all(axis=1)
        rows["status"][~held & (rows["status"] == Status.OUTSIDE)] = Status.NEAR_SINGULAR
    if solved.any():
        reached = arm.forward(q[solved], undefined="nan")[0]
        rows["q"][solved], rows["psi"][solved], rows["gc"][solved] = q[solved], psi, gc
        rows["status"][solved], rows["margin"][solved] = Status.OK, arm.limit_margin(q[solved])
        rows["residual"][solved] = np.linalg.norm(reached[:, :3, 3] - frames[solved, :3, 3], axis=1)
    return JointPath(arm=arm, s=even_parameters(n), poses=frames, **rows)


def _reason(arm: Arm, path: JointPath, psi: float, gc: int, seed: Floats | None, single: bool) -> str:
    """Return in words why the first pose without a solution has none."""
    at = path.first_failure or 0
    failed = int((path.status != Status.OK).sum())
    where = "" if single or len(path) == 1 else f"{failed} of {len(path)} poses fail; pose {at}: "
    if path.status[at] != Status.OUTSIDE:
        return where + unsolved_text(arm, path.poses[at], gc, STATUSES[path.status[at]])
    q = arm.inverse(path.poses[at], psi, gc, seed=seed)
    arcs = ", ".join(
        f"[{degrees(low, 2)}, {degrees(high, 2)}]" for low, high in arm.feasible(path.poses[at], gc)
    )
    outside = f"psi {degrees(psi, 2)} deg is not feasible: {violations(arm, q)}"
    return f"{where}{outside}. Feasible with gc {gc}: {arcs} deg."


def _show_json(path: JointPath, single: bool) -> None:
    pick = 0 if single else slice(None)
    names = np.array([status.name for status in STATUSES])[path.status]
    values = {key: getattr(path, key)[pick] for key in ("q", "psi", "gc", "margin")}
    show_json(values | {"status": names[pick]})


def _all(arm: Arm, pose: Floats, psi: float, seed: Floats | None, as_json: bool) -> int:
    """Print all eight postures, those outside their limits with what they violate."""
    q8 = arm.inverse_all(pose, psi, seed=seed, unreachable="nan")
    known = np.isfinite(q8[:, 0])  # of a chain some branches may have no certain posture
    if not known.any():
        why = Status(int(arm.feasible(pose, 0).status))
        note(f"armangle: {unsolved_text(arm, pose, 0, Status.NEAR_SINGULAR if why else why)}")
        return 1
    within = known.copy()
    within[known] = arm.within_limits(q8[known])
    if as_json:
        show_json({"q": q8, "psi": psi, "gc": np.arange(CONFIGURATIONS), "within_limits": within})
    else:
        show(f"{paint('psi', 'bold')} {degrees(psi)} deg; * outside its limits, all in degrees\n")
        rows = []
        for gc, q in enumerate(q8):
            outside = joint_margins(arm, q) < 0
            cells = [degrees(v, 2) + ("*" if bad else " ") for v, bad in zip(q, outside, strict=True)]
            cells = [paint(cell, "red") if bad else cell for cell, bad in zip(cells, outside, strict=True)]
            rows.append([str(gc), *cells])
        show(table(["gc", *(f"q{i} " for i in range(1, 8))], rows))
    if not known.all():
        listed = ", ".join(map(str, np.flatnonzero(~known)))
        note(f"armangle: gc {listed}: {Status.NEAR_SINGULAR.sentence}")
    if not np.any(within):
        note("armangle: no global configuration is within the limits at this arm angle")
    return 0 if np.any(within) else 1
