"""``armangle demo``: the paper's example, its numbers and its figure 13."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import MissingExtraError, OutputError
from ...files.replacing import replacing
from ...files.tables import save
from ...motion.options import MAX_JOINT_STEP
from .. import paper_example
from ..arguments import add
from ..messages import note, paragraph
from ..screen import degrees, progress, show, show_json, signs_text
from ..tables import paint, table

HELP = """\
See it work: a KUKA iiwa 7 starts close to its joint limits and carries its tool
0.25 m along a straight line; five settings push its elbow off the limits."""
EXAMPLE = "  armangle demo -o demo"

_STORY = """\
A KUKA iiwa 7 starts close to its joint limits and carries its tool 0.25 m along a straight line. \
At every pose the elbow may turn: psi is where it is. Each row below pushes it off the psi where a \
joint limit stands, from far away or near by (alpha: the larger, the nearer) and weakly or strongly (K)."""
_REMARK = """\
It is the example of the paper that armangle began with, which bounds no step of a joint, so nor does the \
demo; step and follow shorten what the policy asks for to {limit} deg."""
_OVERVIEW = "overview.png"
_VIEW = """\
  armangle view
      the same in the browser: play it, drag the tool, turn the elbow"""
_PLAN = """\
  armangle plan {folder}/poses.csv --robot kuka_iiwa7_r800 -o joints.csv
      the whole line at once: the best arm angles, proven between the poses"""
_WRITE = """\
  armangle demo -o demo
      pictures and tables of these runs"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle demo` to its parser."""
    parser.add_argument(
        "-o", "--output", metavar="DIR", help="write a joint CSV and a picture a run there, and poses.csv"
    )
    add(parser, "json")


def run(args: argparse.Namespace) -> int:
    """Print a table of all runs; write their files on request; status 1 if a run fails."""
    with progress("running the example"):
        runs = [paper_example.run(policy) for policy in paper_example.POLICIES]
    written, missing = ([], None) if args.output is None else _write(runs, Path(args.output))
    if args.json:
        show_json({"runs": [_facts(made) for made in runs], "files": written})
    else:
        _show(runs)
        _show_next(args.output, len(written), drawn=missing is None)
    if missing is not None:
        note(f"armangle: no pictures drawn: {missing}")
    for made in runs:
        if not made.path.ok:
            note(f"armangle: {made.name}: {made.path.explain()}")
    return 0 if all(made.path.ok for made in runs) else 1


def _write(runs: list[paper_example.Run], folder: Path) -> tuple[list[str], MissingExtraError | None]:
    """Write all files and return their names, and the reason for missing pictures, or None."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder}: cannot be made: {error.strerror}") from error
    written = [folder / "poses.csv", *(folder / f"{made.name}.csv" for made in runs)]
    for value, file in zip((runs[0].path.poses, *(made.path for made in runs)), written, strict=True):
        save(value, file)
    missing = None
    try:
        with progress("drawing"):
            with replacing(folder / _OVERVIEW) as picture:
                paper_example.draw_overview(runs, picture)
            written.append(folder / _OVERVIEW)
            for made in runs:
                with replacing(folder / f"{made.name}.png") as picture:
                    paper_example.draw(made, picture)
                written.append(folder / f"{made.name}.png")
    except MissingExtraError as error:
        missing = error
    return [str(file) for file in written], missing


def _show(runs: list[paper_example.Run]) -> None:
    """Print the setting of the example and a table with one row for each run."""
    first = runs[0]
    show(paint("One straight line, five ways to keep off the joint limits", "bold"))
    show(f"{paragraph(_STORY)}\n")
    show(f"start  psi {degrees(first.psi_start)} deg, GC {first.gc_start} ({signs_text(first.gc_start)})")
    places = [", ".join(f"{v:.4f}" for v in pose[:3, 3]) for pose in first.path.poses[[0, -1]]]
    show(f"tool   from ({places[0]}) to ({places[1]}) m, {paper_example.POSES} poses\n")
    rows = []
    for made in runs:
        path = made.path
        rows.append(
            [f"{made.policy.alpha:g}", f"{made.policy.K:g}", degrees(made.psi_start), degrees(path.psi[-1]),
             str(path.gc[-1]), degrees(path.margin.min()), degrees(made.largest_step),
             f"{made.seconds_per_pose * 1e6:.2f}"]
        )  # fmt: skip
    headings = ["alpha", "K", "psi start", "psi end", "GC", "least margin", "largest step", "us/pose"]
    show(table(headings, rows))
    show(f"\n{paragraph('Angles in deg; least margin to a joint limit, largest step of a joint.')}")
    show(paragraph(_REMARK.format(limit=f"{np.degrees(MAX_JOINT_STEP):.2f}")))


def _show_next(folder: str | None, files: int, *, drawn: bool) -> None:
    """Print which written file to open, or which command to try next."""
    if folder is None:
        show(f"\nTry next:\n{_WRITE}\n{_VIEW}")
        return
    show(f"\nwrote {files} files to {folder}")
    if drawn:
        show(f"Open {Path(folder) / _OVERVIEW} first: all five between what the joints block.")
        show("Then a run's own picture: arm angle and all seven joints along the line.")
    else:
        show("Open a run's .csv: its joints along the line, in rad.")
    show(f"Try next:\n{_VIEW}\n{_PLAN.format(folder=folder)}")


def _facts(made: paper_example.Run) -> dict[str, Any]:
    """Return the results of a run for JSON: policy, ends, margin and largest step (rad), time for
    each pose.
    """
    path = made.path
    return {
        "name": made.name, "alpha": made.policy.alpha, "K": made.policy.K, "psi_start": made.psi_start,
        "gc_start": made.gc_start, "psi_end": path.psi[-1], "gc_end": path.gc[-1], "ok": path.ok,
        "margin": path.margin.min(), "largest_step": made.largest_step,
        "seconds_per_pose": made.seconds_per_pose,
    }  # fmt: skip
