"""``armangle track``: a stream of poses, one per control cycle, through the tracker."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ..._arrays import Floats
from ...arm.arm import Arm
from ...errors import InputError, ModelError, PathError
from ...files.tables import sample_times
from ...files.trajectories import TrajectoryTable
from ...motion.joint_path import even_parameters
from ...motion.tracking import HandFilter, Tracked, Tracker, Tracking
from ..arguments import add, add_arm, add_scene, joint_bounds, number, some_poses, start_joints
from ..loading import with_scene
from ..messages import note
from ..pictures import draw
from ..screen import counted, fixed, plural, progress, show, show_json, show_speeds, write
from ..tables import table

HELP = """\
Follow a file of poses as the tracker of a teleoperated arm does, one pose in
each control cycle. Shows the distance from the target, the speeds of the
joints, and the status of the cycles with the reason."""
EXAMPLE = """\
  armangle track hand.csv --robot kuka_iiwa7_r800 --rate 90 --plot hand.png"""

_RATE = 250.0
_ACCELERATION = 10.0  # rad/s^2, as `Tracker`
_MM = 1e3
_OTHER = 0.01  # of a time: a larger difference is reported
_SLOWEST, _MOST_TICKS = 1.0, 10_000_000  # s between two rows, and their number: otherwise t is not in s


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle track` to its parser."""
    parser.add_argument(
        "path", metavar="POSES",
        help="poses with the columns x,y,z,qw,qx,qy,qz, one for each cycle, or at times of a column t (s); "
        "empty cells or nan are a lost sample",
    )  # fmt: skip
    add(parser, "start", help="q1,..,q7 in degrees (default: far from limits at the first pose)")
    parser.add_argument(
        "--rate", type=number, metavar="HZ",
        help=f"cycles per second, one row each (default: by the column t; without it {_RATE:g})",
    )  # fmt: skip
    add(parser, "velocity")
    add(
        parser, "acceleration", help=f"bound of the joints, deg/s^2 (default {np.degrees(_ACCELERATION):.0f})"
    )
    parser.add_argument("--filter", action="store_true", help="smooth the target and reject outliers")
    add_arm(parser)
    add_scene(parser)
    add(parser, "output", help="write the trajectory: .csv, .npz, .json, .yaml (ROS)")
    add(parser, "plot", help="draw distance, speeds and statuses over time: .png, .svg or .pdf")
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Print a summary of the control cycles, and write them to --output."""
    arm = with_scene(args)
    velocity = joint_bounds("--velocity", args.velocity, "deg/s", arm.velocity)
    stated = np.full(len(velocity), _ACCELERATION)
    acceleration = joint_bounds("--acceleration", args.acceleration, "deg/s^2", stated)
    if args.rate is not None and not args.rate > 0:
        raise InputError(f"--rate is {args.rate:g}, wanted cycles per second, more than 0")
    frames, rate = _ticks(some_poses(args.path, lost=True), args)
    first_seen = frames[np.isfinite(frames).all(axis=(1, 2)).argmax()]
    tracker = Tracker(arm, 1 / rate, velocity, acceleration, HandFilter() if args.filter else None)
    found = _start(arm, args.start, first_seen)
    tracker.start(found, outside="refuse" if args.start is not None else "escape")
    with progress(f"tracking {counted(len(frames), 'pose')}"):
        first = tracker.q
        ticks = [tracker.step(frame) for frame in frames]
    if args.output is not None:
        write(_rows(arm, first, ticks, tracker.dt), args.output)
    if args.plot is not None:
        shown = velocity if np.isfinite(velocity).all() else None
        draw("tracking", args.plot, ticks, tracker.dt, velocity=shown)
    facts = _summary(ticks, first, tracker.dt)
    if args.json:
        show_json(facts | {"output": args.output, "plot": args.plot})
    else:
        _show(arm, facts)
    return 0


def _say_other_time(path: str, lasts: float) -> None:
    """Print a note if the file's column t lasts another time than `lasts` (s), which --rate gives."""
    try:
        times = sample_times(path)
    except ModelError:  # t is ignored, whatever its values
        return
    if times is None or len(times) < 2 or not abs(times[-1] - times[0] - lasts) > _OTHER * lasts:
        return
    said = f"--rate makes each row a cycle, {lasts:.3g} s in all: the column t, {times[-1] - times[0]:.3g} s"
    note(f"{said}, is left out")


def _ticks(frames: Floats, args: argparse.Namespace) -> tuple[Floats, float]:
    """Return the pose of each control cycle (NaN if missing) and the cycles per second."""
    if args.rate is not None:
        _say_other_time(args.path, (len(frames) - 1) / args.rate)
        return frames, args.rate
    times = sample_times(args.path)
    if times is None or len(times) < 2:
        return frames, _RATE
    steps = np.diff(times)
    rises = steps > 0
    if not rises.all():
        row = int(np.argmin(rises)) + 1
        raise InputError(
            f"{args.path}: t does not rise from row {row} to {row + 1}; with --rate each row is a cycle"
        )
    step = float(np.median(steps))
    at = np.round((times - times[0]) / step)
    if step > _SLOWEST or at[-1] >= _MOST_TICKS:
        raise InputError(
            f"{args.path}: t rises by {step:.4g} a row, up to {times[-1] - times[0]:.4g}, wanted s"
        )
    placed = np.full((int(at[-1]) + 1, 4, 4), np.nan)
    placed[at.astype(int)] = frames
    empty = len(placed) - len(np.unique(at))
    lost = f", {counted(empty, 'cycle')} without a row" if empty else ""
    note(f"armangle: {1 / step:.6g} cycles a second, by the file's t{lost}")
    return placed, 1 / step


def _start(arm: Arm, text: str | None, frame: Floats) -> Floats:
    """Return the joints (rad) of --start, or those of the first pose with the largest distance from limits;
    raise if they are outside the limits, or the pose has none.
    """
    if text is not None:
        return start_joints(text, arm)
    best = arm.solve(frame, prefer="margin")
    if not best.ok:
        why = arm.explain(frame).explain()
        raise PathError(f"no joints hold the first pose: {why.rstrip('.')}; give --start")
    return np.asarray(best.q)


def _rates(ticks: list[Tracked], dt: float) -> tuple[Floats, Floats]:
    """Return velocities and accelerations of the cycles, from rest, (n, 7) each."""
    qd = np.stack([tick.velocity for tick in ticks])
    return qd, np.diff(qd, axis=0, prepend=np.zeros((1, qd.shape[1]))) / dt


def _rows(arm: Arm, first: Floats, ticks: list[Tracked], dt: float) -> TrajectoryTable:
    """Return the cycles as a trajectory that starts at rest at `first`; `dt` is the cycle time (s)."""
    qd, qdd = _rates(ticks, dt)
    q = np.stack([first, *(tick.q for tick in ticks)])
    rest = np.zeros((1, q.shape[1]))
    t = np.asarray(dt * np.arange(len(q)), dtype=float)
    return TrajectoryTable(
        t, even_parameters(len(q)), q, np.vstack([rest, qd]), np.vstack([rest, qdd]), arm.geometry.joint_names
    )


def _summary(ticks: list[Tracked], first: Floats, dt: float) -> dict[str, Any]:
    """Return numbers about all cycles for JSON: statuses, reasons, distances from the target,
    largest rates.
    """
    qd, qdd = _rates(ticks, dt)
    away = np.array([tick.distance for tick in ticks])
    status = np.array([int(tick.status) for tick in ticks])
    return {
        "ticks": len(ticks),
        "dt": dt,
        "start": first,
        "status": {s.name: int((status == s).sum()) for s in Tracking},
        "reasons": _reasons(ticks, dt),
        "distance": {"rms": np.sqrt(np.mean(away**2)), "max": away.max(), "last": away[-1]},
        "gap": float(max(tick.gap for tick in ticks)),
        "fastest": np.abs(qd).max(axis=0),
        "hardest": np.abs(qdd).max(axis=0),
    }


def _reasons(ticks: list[Tracked], dt: float) -> list[dict[str, Any]]:
    """Return why the end effector was not at the target, with link and obstacle, most frequent first."""
    found: dict[tuple[str, str, tuple[str, str] | None], list[int]] = {}
    for i, tick in enumerate(ticks):
        if tick.status != Tracking.FOLLOWING:
            found.setdefault((tick.status.name, tick.why.name, tick.pair), []).append(i)
    return [
        {
            "status": status, "why": why, "obstacle": pair[0] if pair else None,
            "link": pair[1] if pair else None, "ticks": len(at), "first": at[0] * dt, "last": at[-1] * dt,
        }
        for (status, why, pair), at in sorted(found.items(), key=lambda one: -len(one[1]))
    ]  # fmt: skip


def _show(arm: Arm, facts: dict[str, Any]) -> None:
    """Print the summary as a table."""
    away = facts["distance"]
    rows = [
        ["cycles", str(facts["ticks"]), f"of {facts['dt']:.4g} s"],
        *([name, str(count), plural(count, "cycle")] for name, count in facts["status"].items()),
        ["distance from the target, rms", fixed(_MM * away["rms"], 3), "mm"],
        ["largest", fixed(_MM * away["max"], 3), "mm"],
        ["target beyond reach by", fixed(_MM * facts["gap"], 1), "mm"],
    ]
    show(table(["", "", ""], rows, left=(0, 2)).split("\n", 1)[1])
    reasons = [
        [one["status"], one["why"] + (f": {one['link']} at {one['obstacle']}" if one["obstacle"] else ""),
         str(one["ticks"]), fixed(one["first"], 2), fixed(one["last"], 2)]
        for one in facts["reasons"]
    ]  # fmt: skip
    if reasons:
        show(table(["not on the target", "why", "cycles", "from s", "to s"], reasons, left=(0, 1)))
    show_speeds(arm, facts["fastest"], facts["hardest"])
