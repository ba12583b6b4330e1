"""``armangle reach``: compute, resume, verify and show maps of an arm's reach."""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from ..._progress import Bar, Progress
from ...errors import InputError
from ...reach.reach_map import ReachMap, reach_map
from ...reach.store import FIELDS, USUAL
from ..arguments import DEGREE, add, add_arm, angle, number, refuse
from ..loading import any_arm
from ..messages import note
from ..pictures import draw
from ..screen import counted, show, show_json

HELP = """\
Make a map of the reachable poses, in a Zarr store: a grid over the four numbers
of a pose that joints 2 to 6 depend on. The same command resumes an interrupted
map. Without an arm: resume FILE (--resume, --part, --scheduler), check its
values (--verify), or show its contents."""
EXAMPLE = """\
  armangle reach iiwa.zarr --robot kuka_iiwa7_r800 --spacing 0.02 --angle 5
  armangle reach iiwa.zarr --part 17/200      # one task of a batch system
  armangle reach iiwa.zarr --verify"""

_SPACING, _ANGLE = 0.02, 5.0
_SHOWN = 10  # tiles listed by number


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle reach` to its parser."""
    parser.add_argument("store", metavar="FILE", help="folder of the map, or an address that fsspec knows")
    parser.add_argument("--spacing", type=number, metavar="M", help=f"of the wrist (default {_SPACING:g})")
    parser.add_argument("--angle", type=angle, metavar="DEG", help=f"of axis 7 (default {_ANGLE:g})")
    parser.add_argument("--part", metavar="I/N", help="make only the I-th of N shares")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a Dask cluster that makes the map")
    parser.add_argument("--resume", action="store_true", help="without an arm: make the missing tiles")
    parser.add_argument("--verify", action="store_true", help="compare all values with their check sums")
    names = ",".join(FIELDS)
    parser.add_argument(
        "--fields", metavar="NAMES", help=f"fields, by commas: {names} (default: all but the last two)"
    )
    add(parser, "singularity-margin")
    add_arm(parser, required=False)
    add(parser, "plot", help="draw the share of directions that are reached: .png, .svg or .pdf")
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Compute, verify or show a map; status 1 if tiles are missing, except with --part, or wrong."""
    made = args.robot is not None
    if args.verify:
        if made:
            raise InputError("--verify checks a map that is there, and takes no arm")
        return _verify(ReachMap(args.store), args)
    if made:
        found = _make(args)
    elif args.resume or args.part is not None or args.scheduler is not None:
        _check_alone(args)
        found = _resume(ReachMap(args.store), args)
    else:
        _check_alone(args)
        found = ReachMap(args.store)
    missing = found.missing
    if args.plot is not None:
        draw("reach", args.plot, found)
    if args.json:
        show_json({**_facts(found, missing), "unproven": found.unproven})
    else:
        _show(found, missing)
        if missing and args.part is None:
            note("armangle: --resume makes the rest")
    return 1 if missing and args.part is None else 0


def _check_alone(args: argparse.Namespace) -> None:
    """Reject options that the map already determines."""
    refuse(
        args,
        ("spacing", "angle", "fields", "links", "tool", "singularity-margin"),
        f"{args.store} without --robot: the map has its own",
    )


def _make(args: argparse.Namespace) -> ReachMap:
    """Compute the map of --robot and return it."""
    names = USUAL if args.fields is None else tuple(args.fields.split(","))
    with _meter(args.store) as meter:
        return reach_map(
            any_arm(args),
            args.store,
            spacing=_SPACING if args.spacing is None else args.spacing,
            tilt=_ANGLE * DEGREE if args.angle is None else args.angle,
            fields=names,
            part=_part(args.part),
            scheduler=args.scheduler,
            progress=meter,
        )


def _resume(found: ReachMap, args: argparse.Namespace) -> ReachMap:
    """Compute the missing tiles of a map, or a part of them, and return it."""
    with _meter(args.store) as meter:
        return found.resume(part=_part(args.part), scheduler=args.scheduler, progress=meter)


def _verify(found: ReachMap, args: argparse.Namespace) -> int:
    """Print which tiles are missing or differ from their checksums; status 1 if there are any."""
    with _meter(f"verifying {args.store}") as meter:
        wrong = found.verify(meter)
    missing = found.missing
    if args.json:
        show_json({**_facts(found, missing), "wrong": list(wrong)})
    elif not missing:
        show(f"{args.store}: all {counted(found.tiles, 'tile')} are as they were written")
    for what, tiles in (("not as written", wrong), ("missing", missing)):
        if tiles:
            note(f"armangle: {counted(len(tiles), 'tile')} {what}: {_listed(tiles)}")
    if missing:
        note("armangle: --resume makes them")
    return 1 if missing else 0


def _part(text: str | None) -> tuple[int, int] | None:
    """Return (I, N) of the text "I/N", part I of N; None without text; raise for another text."""
    if text is None:
        return None
    try:
        first, last = (int(word) for word in text.split("/"))
    except ValueError:
        raise InputError(f"--part is {text!r}, wanted I/N, as 17/200") from None
    return first, last


def _listed(tiles: tuple[int, ...]) -> str:
    """Return the first tile numbers as text, and how many more there are."""
    more = f" and {len(tiles) - _SHOWN} more" if len(tiles) > _SHOWN else ""
    return ", ".join(map(str, tiles[:_SHOWN])) + more


def _facts(found: ReachMap, missing: tuple[int, ...]) -> dict[str, object]:
    """Return a map's arm, grid and missing tiles for JSON."""
    return {
        "store": found.path, "robot": found.arm.name, "fields": list(found.fields),
        "shape": list(found.shape), "spacing": found.spacing, "tiles": found.tiles, "missing": list(missing),
    }  # fmt: skip


def _show(found: ReachMap, missing: tuple[int, ...]) -> None:
    """Print a map's arm, grid and fields, and how many tiles are missing."""
    r, z, tilts, turns = found.shape
    show(f"{found.path}: what {found.arm.name or 'an arm'} reaches")
    show(f"  {r} x {z} places of the wrist, {1e3 * found.spacing:g} mm apart")
    show(f"  {tilts} x {turns} directions of axis 7, {180 / tilts:.4g} deg apart")
    show(f"  fields {', '.join(found.fields)}")
    show(f"  {found.tiles - len(missing)} of {counted(found.tiles, 'tile')} made")
    if "unproven" in found.fields:
        show(f"  {found.unproven} of {counted(math.prod(found.shape), 'cell')} neither reached nor excluded")


@contextmanager
def _meter(what: str) -> Iterator[Progress | None]:
    """Yield a bar of a task for a terminal, otherwise None; an interrupted map says how to go on."""
    try:
        yield Bar(f"{what} ") if sys.stderr.isatty() else None
    except KeyboardInterrupt:
        note("armangle: interrupted; the same command goes on where it was")
        raise
