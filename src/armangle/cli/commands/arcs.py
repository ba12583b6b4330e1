"""``armangle arcs``: the feasible arm angles and what ends them."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from ..._arrays import CONFIGURATIONS, JOINTS, Floats
from ..._core import Wanted
from ...arm.arcs import ArcEnd, ArcSet
from ...arm.arm import Arm
from ...errors import InputError
from ...status import Status
from ..arguments import (
    POSE_HELP,
    add_arm,
    add_json,
    add_scene,
    add_singularity_margin,
    joints,
    pose,
    the_arm,
    with_body,
)
from ..messages import note
from ..screen import degrees, left_out, show, show_json, signs_text, unsolved_text
from ..tables import paint, table

HELP = """\
The arm angles psi that keep all joints within their limits at a pose, as arcs,
and which joint's limit ends each."""
EXAMPLE = """\
  armangle arcs --robot kuka_iiwa7_r800 \\
      --q -5.4101,-26.4986,-48.1542,-61.65,152.6198,114.4466,8.1812"""

Found = tuple[int, int | None, ArcSet]

_STRIP = 60
_EVERY = 0


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments."""
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--pose", metavar="POSE", help=POSE_HELP)
    where.add_argument("--q", metavar="Q", help="the pose, and --gc, of joints q1,..,q7 in degrees")
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--gc", type=int, choices=range(CONFIGURATIONS), help="global configuration")
    which.add_argument("--all", action="store_true", help="all eight (the default with --pose)")
    parser.add_argument(
        "--joint", nargs="?", type=int, const=_EVERY, choices=range(_EVERY, JOINTS + 1), metavar="1..7",
        help="what this joint alone allows; without a number every joint",
    )  # fmt: skip
    add_arm(parser)
    add_scene(parser)
    add_singularity_margin(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the arcs; status 1 where there is none."""
    arm, scene = with_body(the_arm(args), args)
    if scene is not None and args.joint is not None:
        raise InputError("--scene does not go with --joint: obstacles block arm angles, whatever the joints")
    if args.q is not None:
        frame, _, own = arm.forward(joints("--q", args.q), undefined="nan")
        configurations = range(CONFIGURATIONS) if args.all else [int(own) if args.gc is None else args.gc]
    else:
        frame = pose("--pose", args.pose)
        configurations = range(CONFIGURATIONS) if args.gc is None else [args.gc]
    found: list[Found] = []
    for gc in configurations:
        if args.joint is None:
            arcs = arm.feasible(frame, gc, singularity_margin=args.singularity_margin, scene=scene)
            found.append((gc, None, arcs))
            continue
        each = arm.joint_feasible(frame, gc, singularity_margin=args.singularity_margin)
        chosen = range(1, JOINTS + 1) if args.joint == _EVERY else [args.joint]
        found += [(gc, i, each[i - 1]) for i in chosen]
    none = all(bool(arcs.is_empty) for _, _, arcs in found)
    if args.json:
        show_json([_facts(*entry) for entry in found])
    elif not none:
        _show(arm, frame, found, args.singularity_margin)
    unproven = left_out(
        (f"gc {gc}" if joint is None else f"gc {gc} joint {joint}", float(arcs.unproven))
        for gc, joint, arcs in found
    )
    if unproven:
        note(f"armangle: {unproven}")
    if none:
        known = "proven" if unproven else "feasible"
        note(f"armangle: no {known} arm angle. {_why(arm, frame, found)}")
        return 1
    return 0


def _why(arm: Arm, pose: Floats, found: list[Found]) -> str:
    """Return each different reason in words."""
    reasons: dict[Status, list[str]] = {}
    for gc, _, arcs in found:
        reasons.setdefault(Status(int(arcs.status)), []).append(str(gc))
    texts = {status: unsolved_text(arm, pose, int(gcs[0]), status) for status, gcs in reasons.items()}
    if len(reasons) == 1:
        return next(iter(texts.values()))
    return " ".join(f"gc {', '.join(dict.fromkeys(gcs))}: {texts[status]}" for status, gcs in reasons.items())


def _show(arm: Arm, frame: Floats, found: list[Found], margin: float) -> None:
    per_joint = found[0][1] is not None
    rows: list[list[str]] = []
    for gc, joint, arcs in found:
        first = [str(gc), *([str(joint)] if per_joint else [])]
        for low, high, begin, end in _lines(arcs):
            rows.append([*first, low, high, begin, end])
            first = [""] * len(first)
    headings = ["gc", *(["joint"] if per_joint else []), "from deg", "to deg", "begins at", "ends at"]
    show(table(headings, rows, left=(len(headings) - 2, len(headings) - 1)))
    show()
    width = 8 if per_joint else 4
    for gc, joint, arcs in found:
        label = f"{gc:2d}" + (f" q{joint}" if per_joint else "")
        show(f"{label:{width}}{_strip(arcs, _open(arm, frame, gc, joint, margin))}")
    show(f"{'':{width}}{'-180':<{_STRIP // 2 - 4}}psi  0{'180':>{_STRIP // 2 - 2}}")
    if len({gc for gc, _, _ in found}) == 1:
        show(f"\ngc {found[0][0]}: {signs_text(found[0][0])}")


def _lines(arcs: ArcSet) -> list[tuple[str, str, str, str]]:
    if arcs.is_empty:
        return [("-", "-", f"none: {Status(int(arcs.status)).name}", "")]
    lines = []
    for (low, high), ends in zip(arcs, arcs.ends, strict=True):
        begin, end = (_end_text(ends[0]), _end_text(ends[1])) if ends else ("full circle", "")
        lines.append((degrees(low), degrees(high), begin, end))
    return lines


def _end_text(end: ArcEnd) -> str:
    if end.obstacle is not None:
        return f"{end.link} at {end.obstacle}"
    if end.side == "unproven":
        return "not proven beyond"
    return f"joint {end.joint} {end.side} {degrees(end.value, 1)}"


def _open(arm: Arm, frame: Floats, gc: int, joint: int | None, margin: float) -> ArcSet:
    """Return what is not proven of a set."""
    if joint is None:
        return arm._left_out(frame, gc, margin)
    return arm._left_out(frame, gc, margin, Wanted.JOINTS)[joint - 1]


def _strip(arcs: ArcSet, unproven: ArcSet) -> str:
    """Return the circle from -180 to 180 deg as a strip of characters, "?" for what is not proven."""
    centres = (np.arange(_STRIP) + 0.5) / _STRIP * 2 * np.pi - np.pi
    cells = zip(np.asarray(arcs.contains(centres)), np.asarray(unproven.contains(centres)), strict=True)
    drawn = {True: paint("?", "yellow"), False: paint("·", "dim")}
    return "".join(paint("█", "green") if inside else drawn[bool(left)] for inside, left in cells)


def _facts(gc: int, joint: int | None, arcs: ArcSet) -> dict[str, Any]:
    ends = [[_end_facts(end) for end in pair] for pair in arcs.ends]
    facts: dict[str, Any] = {"gc": gc} if joint is None else {"gc": gc, "joint": joint}
    status = Status(int(arcs.status)).name
    return facts | {"status": status, "intervals": arcs.intervals, "ends": ends, "unproven": arcs.unproven}


def _end_facts(end: ArcEnd) -> dict[str, Any]:
    facts: dict[str, Any] = {"joint": end.joint, "side": end.side, "value": end.value}
    return facts if end.obstacle is None else facts | {"obstacle": end.obstacle, "link": end.link}
