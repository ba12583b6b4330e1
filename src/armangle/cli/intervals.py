"""`armangle ik --intervals`: the feasible intervals of the arm angle, and which joint ends them."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from .._arrays import CONFIGURATIONS, JOINTS, Floats
from .._core import Wanted
from ..arm.arcs import ArcEnd, ArcSet
from ..arm.arm import Arm
from ..errors import InputError
from ..motion.joint_path import JointPath
from ..status import Status
from .arguments import refuse
from .messages import note
from .pictures import draw
from .screen import degrees, left_out, redundancy_name, show, show_json, signs_text, unsolved_text
from .solving import Asked
from .tables import paint, table

Entry = tuple[int, int | None, ArcSet]
EVERY = -1
"""Option value: the intervals of each joint separately."""
_STRIP = 60


def draw_map(what: JointPath | tuple[Arm, Floats], args: argparse.Namespace) -> int:
    """Draw the feasible intervals along a motion, or along poses, to --plot; raise without it."""
    if args.plot is None or args.intervals:
        raise InputError("--intervals of a file is a picture: --plot FILE, without a joint")
    draw("feasible_map", args.plot, what, gc=args.gc)
    if args.json:
        show_json({"plot": args.plot})
    if isinstance(what, JointPath) and not what.ok:
        note(f"armangle: {args.joints}: {what.explain()}")
    return 0


def show_intervals(asked: Asked, args: argparse.Namespace) -> int:
    """Print the feasible intervals; status 1 if there is none."""
    arm, frame = asked.arm, asked.frame
    branches = range(CONFIGURATIONS) if asked.gc is None else [asked.gc]
    if args.plot is not None and asked.gc is None:
        raise InputError("--plot needs --gc: a pose alone does not say which branch to draw")
    if args.intervals:
        refuse(args, ("scene", "plot"), "--intervals of a joint")
        each = {gc: arm.feasible(frame, gc, per_joint=True) for gc in branches}
        chosen = range(1, JOINTS + 1) if args.intervals == EVERY else [args.intervals]
        found: list[Entry] = [(gc, i, each[gc][i - 1]) for gc in branches for i in chosen]
    else:
        found = [(gc, None, arm.feasible(frame, gc)) for gc in branches]
    none = all(bool(intervals.is_empty) for _, _, intervals in found)
    if args.json:
        show_json([_facts(*entry) for entry in found])
    elif not none:
        _show(arm, frame, found)
    unproven = left_out(
        (f"gc {gc}" if joint is None else f"gc {gc} joint {joint}", float(intervals.unproven))
        for gc, joint, intervals in found
    )
    if unproven:
        note(f"armangle: {unproven}")
    if none:
        known = "proven" if unproven else "feasible"
        note(f"armangle: no {known} arm angle. {_why(arm, frame, found)}")
    if args.plot is not None:
        draw("circle", args.plot, arm, frame, asked.gc, psi=asked.psi)
    return int(none)


def _why(arm: Arm, pose: Floats, found: list[Entry]) -> str:
    """Return in words the reasons why branches have no interval, each reason once with its branches."""
    reasons: dict[Status, list[str]] = {}
    for gc, _, intervals in found:
        reasons.setdefault(Status(int(intervals.status)), []).append(str(gc))
    texts = {status: unsolved_text(arm, pose, int(gcs[0]), status) for status, gcs in reasons.items()}
    if len(reasons) == 1:
        return next(iter(texts.values()))
    return " ".join(f"gc {', '.join(dict.fromkeys(gcs))}: {texts[status]}" for status, gcs in reasons.items())


def _show(arm: Arm, frame: Floats, found: list[Entry]) -> None:
    """Print the intervals of all branches or joints as a table, with strips of the circle."""
    per_joint = found[0][1] is not None
    rows: list[list[str]] = []
    for gc, joint, intervals in found:
        first = [str(gc), *([str(joint)] if per_joint else [])]
        for low, high, begin, end in _lines(intervals):
            rows.append([*first, low, high, begin, end])
            first = [""] * len(first)
    headings = ["gc", *(["joint"] if per_joint else []), "from deg", "to deg", "begins at", "ends at"]
    show(table(headings, rows, left=(len(headings) - 2, len(headings) - 1)))
    show()
    width = 8 if per_joint else 4
    for gc, joint, intervals in found:
        label = f"{gc:2d}" + (f" q{joint}" if per_joint else "")
        show(f"{label:{width}}{_strip(intervals, _unproven(arm, frame, gc, joint))}")
    middle = f"{redundancy_name(arm)}  0"
    half = _STRIP // 2
    show(f"{'':{width}}{'-180':<{half - len(middle) + 1}}{middle}{'180':>{half - 2}}")
    if len({gc for gc, _, _ in found}) == 1:
        show(f"\ngc {found[0][0]}: {signs_text(found[0][0])}")


def _lines(intervals: ArcSet) -> list[tuple[str, str, str, str]]:
    """Return each interval as text: its two ends (deg) and their causes; one line with the status if none."""
    if intervals.is_empty:
        return [("-", "-", f"none: {Status(int(intervals.status)).name}", "")]
    lines = []
    for (low, high), ends in zip(intervals, intervals.ends, strict=True):
        begin, end = (_end_text(ends[0]), _end_text(ends[1])) if ends else ("full circle", "")
        lines.append((degrees(low), degrees(high), begin, end))
    return lines


def _end_text(end: ArcEnd) -> str:
    """Return the cause of an interval's end: an obstacle, a joint limit, or that no more is proven."""
    if end.obstacle is not None:
        return f"{end.link} at {end.obstacle}"
    if end.side == "unproven":
        return "not proven beyond"
    return f"joint {end.joint} {end.side} {degrees(end.value, 1)}"


def _unproven(arm: Arm, frame: Floats, gc: int, joint: int | None) -> ArcSet:
    """Return the arm angles that are proven neither feasible nor infeasible."""
    return arm._left_out(frame, gc) if joint is None else arm._left_out(frame, gc, Wanted.JOINTS)[joint - 1]


def _strip(intervals: ArcSet, unproven: ArcSet) -> str:
    """Return the circle from -180 to 180 deg as characters: filled where feasible, "?" where unproven."""
    centres = (np.arange(_STRIP) + 0.5) / _STRIP * 2 * np.pi - np.pi
    cells = zip(np.asarray(intervals.contains(centres)), np.asarray(unproven.contains(centres)), strict=True)
    drawn = {True: paint("?", "yellow"), False: paint("·", "dim")}
    return "".join(paint("█", "green") if inside else drawn[bool(left)] for inside, left in cells)


def _facts(gc: int, joint: int | None, intervals: ArcSet) -> dict[str, Any]:
    """Return the intervals of a branch, or of one joint in it, for JSON."""
    ends = [[_end_facts(end) for end in pair] for pair in intervals.ends]
    facts: dict[str, Any] = {"gc": gc} if joint is None else {"gc": gc, "joint": joint}
    status = Status(int(intervals.status)).name
    found = {"status": status, "intervals": intervals.intervals, "ends": ends, "unproven": intervals.unproven}
    return facts | found


def _end_facts(end: ArcEnd) -> dict[str, Any]:
    """Return the cause of an interval's end for JSON."""
    facts: dict[str, Any] = {"joint": end.joint, "side": end.side, "value": end.value}
    return facts if end.obstacle is None else facts | {"obstacle": end.obstacle, "link": end.link}
