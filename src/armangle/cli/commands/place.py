"""``armangle place``: where to put the robot for a file of poses."""

from __future__ import annotations

import argparse

import numpy as np

from ..._arrays import Floats
from ...errors import InputError
from ...files.tables import load_poses
from ...poses import COLUMNS, rows_from_poses
from ...reach.placement import Placement, place
from ..arguments import add, add_arm, number
from ..loading import any_arm
from ..messages import note
from ..screen import counted, degrees, progress, show, show_json
from ..tables import table

HELP = """\
Find base positions for a file of poses: positions on a grid, each with the
exact best yaw of the base."""
EXAMPLE = """\
  armangle place grasps.csv --robot openarm_v10 \\
      --x -0.5,0.5 --y -0.5,0.5 --step 0.05"""

_ROWS = 10  # number of best positions shown
_MOST = 1_000_000  # positions


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `armangle place` to its parser."""
    parser.add_argument("path", metavar="PATH", help="poses in the world, with the columns x,y,z,qw,qx,qy,qz")
    for axis in ("x", "y"):
        parser.add_argument(
            f"--{axis}", required=True, metavar="FROM,TO", help=f"where axis 1 may stand along {axis}, m"
        )
    parser.add_argument(
        "--step", type=number, default=0.05, metavar="M", help="between positions (default 0.05)"
    )
    parser.add_argument("--z", type=number, default=0.0, metavar="M", help="height of the base (default 0)")
    add_arm(parser)
    add(parser, "singularity-margin", "json")


def run(args: argparse.Namespace) -> int:
    """Print the best bases; status 1 if no pose is reachable from any."""
    arm = any_arm(args)
    x, y = _line("--x", args.x, args.step), _line("--y", args.y, args.step)
    if len(x) * len(y) > _MOST:
        raise InputError(f"--step {args.step:g} makes {len(x) * len(y)} positions, wanted at most {_MOST}")
    with progress(f"reading {args.path}"):
        poses = load_poses(args.path)
    with progress(f"placing at {counted(len(x) * len(y), 'position')}"):
        found = place(arm, poses, x, y, z=args.z)
    if args.json:
        show_json(_facts(found))
    else:
        _show(found)
    if found.reached.max() > 0:
        return 0
    note("armangle: no pose can be held from any of these positions")
    return 1


def _line(option: str, text: str, step: float) -> Floats:
    """Return positions `step` (m) apart, from FROM and at most to TO, of `text` FROM,TO; raise InputError."""
    try:
        first, last = (number(part) for part in text.split(","))
    except (ValueError, argparse.ArgumentTypeError):
        raise InputError(f"{option} is {text!r}, wanted FROM,TO in metres, as -0.5,0.5") from None
    if not step > 0:
        raise InputError(f"--step is {step:g}, wanted metres above 0")
    if last < first:
        raise InputError(f"{option} is {text!r}, wanted FROM <= TO")
    count = int((last - first) / step * (1 + 1e-12)) + 1
    if count > _MOST:
        raise InputError(f"--step {step:g} makes {count} positions along {option}, wanted at most {_MOST}")
    return np.array([first + step * k for k in range(count)])


def _show(found: Placement) -> None:
    """Print the best base positions, and how many poses the best one does not reach, with the reasons."""
    order = np.lexsort((-found.stretch.ravel(), -found.reached.ravel()))[:_ROWS]
    lines = []
    for k in order[found.reached.ravel()[order] > 0]:
        i, j = np.unravel_index(int(k), found.reached.shape)
        lines.append(
            [f"{found.reached[i, j]:g}", f"{found.x[i]:.3f}", f"{found.y[j]:.3f}",
             degrees(found.yaw[i, j], 1), degrees(found.stretch[i, j], 1)]
        )  # fmt: skip
    if lines:
        show(f"of {counted(len(found.poses), 'pose')}, the arm {found.arm.name or ''} holds".rstrip())
        show()
        show(table(["held", "x m", "y m", "best yaw deg", "yaw may vary by deg"], lines))
        show()
    reasons: dict[str, int] = {}
    for _, why in found.missed():
        reasons[why.sentence] = reasons.get(why.sentence, 0) + 1
    if reasons:
        show("not held from the first of these:" if lines else "not held from any of these positions:")
    for sentence, count in reasons.items():
        show(f"  {counted(count, 'pose')}: {sentence}")


def _facts(found: Placement) -> dict[str, object]:
    """Return a placement for JSON: the poses reached from each base position, and the best base pose."""
    base = dict(zip(COLUMNS, rows_from_poses(found.best()[None])[0].tolist(), strict=True))
    missed = [{"pose": k, "status": why.name} for k, why in found.missed()]
    return {
        "poses": len(found.poses), "x": found.x, "y": found.y, "z": found.z, "reached": found.reached,
        "yaw": found.yaw, "stretch": found.stretch, "unproven": found.unproven, "best": base,
        "missed": missed,
    }  # fmt: skip
