"""``armangle robots``: the robots of the catalogue."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...arm.arm import Arm
from ...models.catalogue import CatalogueEntry, catalogue, load_robot
from ...models.description import ELBOW_OFFSETS
from ...models.offset import offset_catalogue, offset_source
from ..arguments import add
from ..messages import paragraph
from ..screen import degrees, show, show_json
from ..tables import paint, table

HELP = "List the arms of the catalogue, all or by words, or show one with its source."
EXAMPLE = "  armangle robots\n  armangle robots yaskawa\n  armangle robots kuka_iiwa7_r800"

_LENGTHS = ("d_bs", "d_se", "d_ew", "d_wf", "a_3", "a_4", "d_4")
_JOINTS = ("signs", "offsets", "lower", "upper", "velocity", "joint_names")
_DOUBTS = ("lengths", "limits", "velocity")


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle robots` to its parser."""
    parser.add_argument("name", nargs="*", metavar="NAME", help="one arm, or words to search for")
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Print a table of all arms, or of those that match words, or one arm."""
    search = " ".join(args.name)
    names = (search,) if search in catalogue() else catalogue(search)
    if len(names) < 2:
        name = names[0] if names else search
        if args.json:
            show_json(_facts(name))
        elif name in offset_catalogue():
            _show_offset(name)
        else:
            _show_one(load_robot(name))
    elif args.json:
        show_json([_facts(name) for name in names])
    else:
        _show_all(names)
    return 0


def _show_all(names: Sequence[str]) -> None:
    """Print a table with a blank line between makers of several arms."""
    rows: list[list[str]] = []
    makers = [name.partition("_")[0] for name in names]
    for before, maker, name in zip(["", *makers], makers, names, strict=False):
        if rows and maker != before and max(makers.count(maker), makers.count(before)) > 1:
            rows.append([""] * 4)
        if name in offset_catalogue():
            arm = Arm.from_catalogue(name)
            what = [arm.kind.replace("_", " "), ""]
        else:
            entry = load_robot(name)
            arm, what = _arm(entry), [_offset(entry), _doubtful(entry)]
        rows.append([name, f"{arm.geometry.reach * 1e3:.0f}", *what])
    show(table(["name", "reach mm", "elbow", "not trusted"], rows, left=(0, 2, 3)))
    show(f"\n{len(names)} arms; reach: greatest distance of the wrist from the shoulder")


def _arm(entry: CatalogueEntry) -> Arm:
    """Return the arm of an entry of the catalogue."""
    return Arm._from_description(entry.description)


def _offset(entry: CatalogueEntry) -> str:
    """Return whether the elbow of an arm is "offset" or "in line"."""
    return "offset" if any(getattr(entry.description, name) for name in ELBOW_OFFSETS) else "in line"


def _doubtful(entry: CatalogueEntry) -> str:
    """Return which numbers of an entry (such as limits) its source may have wrong, separated by commas."""
    return ", ".join(what for what in _DOUBTS if not getattr(entry, f"{what}_trusted"))


def _show_one(entry: CatalogueEntry) -> None:
    """Print all numbers of an arm of the catalogue."""
    d = entry.description
    show(paint(entry.name, "bold"))
    show(paragraph(f"{entry.title}. Source: {entry.source}."))
    show(paragraph(f"Revision of the source: {entry.revision or 'not checked'}."))
    show(paragraph(f"Tip: {entry.tip}."))
    for line in d.notes:
        show(paragraph(f"Note: {line}"))
    lengths = [f"{name} {getattr(d, name) * 1e3:g}" for name in _LENGTHS]
    reach = f"reach, shoulder to wrist, {_arm(entry).geometry.reach * 1e3:.1f}"
    show(paragraph(f"Lengths (mm): {', '.join(lengths)}; {reach}") + "\n")
    rows = [
        [str(i + 1), d.joint_names[i], degrees(d.lower[i], 1), degrees(d.upper[i], 1),
         degrees(d.velocity[i], 0), f"{d.signs[i]:+d}", f"{np.degrees(d.offsets[i]):g}"]
        for i in range(len(d.lower))
    ]  # fmt: skip
    headings = ["joint", "name", "lower deg", "upper deg", "deg/s", "sign", "zero deg"]
    show(table(headings, rows, left=(1,)))


def _show_offset(name: str) -> None:
    """Print all numbers of an arm with an offset wrist or shoulder."""
    arm, source = Arm.from_catalogue(name), offset_source(name)
    show(paint(name, "bold"))
    for line in (
        f"Source: {source}.",
        *(f"Note: {note}" for note in arm.geometry.notes),
        *str(arm).splitlines(),
    ):
        show(paragraph(line))


def _facts(name: str) -> dict[str, Any]:
    """Return all numbers of an arm of the catalogue for JSON."""
    if name in offset_catalogue():
        arm = Arm.from_catalogue(name)
        numbers = (*_LENGTHS[:-1], "a_1", "a_6", *_JOINTS, "notes", "base", "tool", "reach")
        return {"name": name, "source": offset_source(name)} | {key: arm._number(key) for key in numbers}
    entry = load_robot(name)
    d = entry.description
    keys = (*_LENGTHS, *_JOINTS, "notes", "base", "tool")
    facts = {"name": entry.name, "title": entry.title, "source": entry.source}
    facts |= {"revision": entry.revision, "tip": entry.tip}
    trust = {f"{what}_trusted": getattr(entry, f"{what}_trusted") for what in _DOUBTS}
    return facts | {key: getattr(d, key) for key in keys} | trust | {"reach": _arm(entry).geometry.reach}
