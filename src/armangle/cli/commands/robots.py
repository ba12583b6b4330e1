"""``armangle robots``: the robots of the catalogue."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any

import numpy as np

from ...arm.arm import Arm
from ...models.catalogue import catalogue, load_robot
from ...models.description import ELBOW_OFFSETS
from ..arguments import add
from ..messages import paragraph
from ..screen import degrees, show, show_json
from ..tables import paint, table

HELP = "List the arms of the catalogue, all or by words, or show one with its source."
EXAMPLE = "  armangle robots\n  armangle robots yaskawa\n  armangle robots kuka_iiwa7_r800"

_LENGTHS = ("d_bs", "d_se", "d_ew", "d_wf", "a_1", "a_3", "a_4", "a_6", "d_4")
_JOINTS = ("signs", "offsets", "lower", "upper", "velocity", "joint_names")
_DOUBTS = ("lengths", "limits", "velocity")


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle robots` to its parser."""
    parser.add_argument("name", nargs="*", metavar="NAME", help="one arm, or words to search for")
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Print a table of all arms, or of those that match words; of a single one its numbers; none raises."""
    search = " ".join(args.name)
    names = (search,) if search in catalogue() else catalogue(search)
    if len(names) < 2:
        facts = _facts(names[0] if names else search)
        show_json(facts) if args.json else _show_one(facts)
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
        facts = _facts(name)
        offset = "offset" if any(facts[key] for key in ELBOW_OFFSETS) else "in line"
        elbow = offset if facts["kind"] == "srs" else facts["kind"].replace("_", " ")
        doubtful = ", ".join(what for what in _DOUBTS if not facts[f"{what}_trusted"])
        rows.append([name, f"{facts['reach'] * 1e3:.0f}", elbow, doubtful])
    show(table(["name", "reach mm", "elbow", "not trusted"], rows, left=(0, 2, 3)))
    show(f"\n{len(names)} arms; reach: greatest distance of the wrist from the shoulder")


def _show_one(facts: dict[str, Any]) -> None:
    """Print all numbers of an arm of the catalogue."""
    show(paint(facts["name"], "bold"))
    show(paragraph(f"{facts['title']}. Source: {facts['source']}."))
    show(paragraph(f"Revision of the source: {facts['revision'] or 'not checked'}."))
    show(paragraph(f"Tip: {facts['tip']}."))
    for line in facts["notes"]:
        show(paragraph(f"Note: {line}"))
    lengths = [f"{name} {facts[name] * 1e3:g}" for name in _LENGTHS]
    reach = f"reach, shoulder to wrist, {facts['reach'] * 1e3:.1f}"
    show(paragraph(f"Lengths (mm): {', '.join(lengths)}; {reach}") + "\n")
    rows = [
        [str(i + 1), name, degrees(lower, 1), degrees(upper, 1), degrees(velocity, 0), f"{sign:+d}",
         f"{np.degrees(offset):g}"]
        for i, (sign, offset, lower, upper, velocity, name) in enumerate(
            zip(*(facts[key] for key in _JOINTS), strict=True)
        )
    ]  # fmt: skip
    headings = ["joint", "name", "lower deg", "upper deg", "deg/s", "sign", "zero deg"]
    show(table(headings, rows, left=(1,)))


def _facts(name: str) -> dict[str, Any]:
    """Return all numbers of an arm of the catalogue, and where they are from."""
    entry = load_robot(name)
    arm = Arm._from_description(entry.description)
    words = ("name", "title", "source", "revision", "tip", *(f"{what}_trusted" for what in _DOUBTS))
    numbers = (*_LENGTHS, *_JOINTS, "notes", "base", "tool", "reach")
    facts = {key: getattr(entry, key) for key in words}
    return facts | {"kind": arm.kind} | {key: arm._number(key) for key in numbers}
