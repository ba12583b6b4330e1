"""`armangle ik`: the nearest solution of each pose, all solutions, or that of an arm angle."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arrays import CONFIGURATIONS, Floats, Ints, millimetres
from ..arm.arm import Arm
from ..arm.solution import Solution
from ..motion.joint_path import JointPath, blank_rows, even_parameters
from ..status import STATUSES, Status
from .messages import note, paragraph
from .screen import (
    counted,
    degrees,
    joint_margins,
    left_out,
    progress,
    show,
    show_configuration,
    show_json,
    show_many,
    unsolved_text,
    violations,
    write,
)
from .tables import paint, table

_NAMES = np.array([status.name for status in STATUSES])
_COLUMNS = [f"q{i}" for i in range(1, 8)]
Found = tuple[float, int] | None


@dataclass(frozen=True)
class Asked:
    """The arguments of `armangle ik`: poses (4, 4) or (N, 4, 4) of an arm, and the selected results."""

    arm: Arm
    frame: Floats
    seed: Floats | None
    gc: int | None
    psi: float | None

    def __post_init__(self) -> None:
        if self.frame.ndim == 2:  # an error of one pose names it without an index
            self.arm.reachable(self.frame)

    @property
    def frames(self) -> Floats:
        """All poses, (N, 4, 4)."""
        return self.frame.reshape(-1, 4, 4)

    @property
    def pick(self) -> Any:
        """Index that takes the single result of one pose out of a batch of one, or keeps a batch."""
        return 0 if self.frame.ndim == 2 else slice(None)


def forward(arm: Arm, q: Floats) -> tuple[Floats, Floats, Ints]:
    """Return poses, arm angles (NaN if undefined) and branches of joints."""
    pose, psi, gc = arm.forward(q, on_error="nan")
    return pose, np.asarray(psi), np.asarray(gc)


def solve(asked: Asked, args: argparse.Namespace) -> tuple[int, Found]:
    """Print the solution of each pose nearest to --seed, or to the middle of the ranges.

    Returns the exit status, 1 if a pose has none, and psi and gc of the first solution if all have one.
    """
    arm, frames = asked.arm, asked.frames
    seed, name = _seed(asked)
    with progress("solving"):
        metric: Any = args.metric or "l2"
        found = arm.solve(frames, seed, metric=metric, gc=asked.gc, roll=args.roll, fallback=args.fallback)
    if args.output is not None:
        write(_path(arm, frames, found), args.output)
    names, ok = _NAMES[np.asarray(found.status)], np.asarray(found.ok)
    if args.json:
        values = {
            key: getattr(found, key)[asked.pick] for key in ("q", "psi", "gc", "distance", "margin", "gap")
        }
        facts = {"status": names[asked.pick], "seed": seed, "metric": metric}
        show_json(values | facts | {"redundancy": arm.redundancy})
    elif asked.frame.ndim == 3:
        show(f"nearest to {name}\n")
        show_many(found.q, names)
        unproven = int((names == Status.UNPROVEN.name).sum())
        if unproven:
            show(paragraph(f"\nUNPROVEN, {counted(unproven, 'pose')}: {Status.UNPROVEN.sentence}"))
    elif np.isfinite(found.q).all():
        _show_one(arm, found, name, metric)
    if ok.all():
        return 0, (float(np.ravel(found.psi)[0]), int(np.ravel(found.gc)[0])) if len(frames) else None
    failed = np.flatnonzero(~ok)
    where = "" if asked.frame.ndim == 2 else f"{len(failed)} of {len(frames)} poses fail; pose {failed[0]}: "
    why = STATUSES[int(np.ravel(found.status)[failed[0]])]
    note(f"armangle: {where}{unsolved_text(arm, frames[failed[0]], asked.gc or 0, why)}")
    return 1, None


def _seed(asked: Asked) -> tuple[Floats, str]:
    """Return the joints of --seed or the middle of the limits (rad), and how to call them.

    A joint without two limits has 0, or the value nearest to it within its limit.
    """
    if asked.seed is not None:
        return asked.seed, "--seed"
    lower, upper = asked.arm.lower, asked.arm.upper
    with np.errstate(invalid="ignore"):  # of a joint without limits
        middle = 0.5 * (lower + upper)
    return np.where(np.isfinite(middle), middle, np.clip(0.0, lower, upper)), "the middle of the joint ranges"


def _show_one(arm: Arm, found: Solution, name: str, metric: str) -> None:
    """Print the one solution of a batch of one."""
    psi, gc, distance = (float(np.ravel(value)[0]) for value in (found.psi, found.gc, found.distance))
    show_configuration(arm, found.q[0], psi, int(gc))
    off = degrees(distance, 2)
    far = (
        f"no joint is further than {off} deg from it"
        if metric == "max"
        else f"{off} deg from it (root of the sum of squares)"
    )
    show(f"\nnearest to {name}:\n{far}")
    if np.ravel(found.status)[0] == Status.UNPROVEN:
        show(paragraph(f"UNPROVEN: {Status.UNPROVEN.sentence}"))
    if not np.all(found.ok):
        off = millimetres(float(np.ravel(found.gap)[0]))
        said = f"This is the nearest reachable pose, {off} from the one asked; a radian counts as 200 mm."
        show(paragraph(f"\n{said}"))


def _path(arm: Arm, frames: Floats, found: Solution) -> JointPath:
    """Return the solutions of poses as a path with one row for each pose, each with its status."""
    residual, ok = np.full(len(frames), np.nan), np.asarray(found.ok)
    residual[ok] = _off(arm, found.q[ok], frames[ok])
    rows: dict[str, Any] = {key: getattr(found, key) for key in ("q", "psi", "gc", "status", "margin")}
    return JointPath(arm=arm, s=even_parameters(len(frames)), poses=frames, residual=residual, **rows)


def _off(arm: Arm, q: Floats, frames: Floats) -> Floats:
    """Return the distance (m) between the positions that joints reach and those of the poses."""
    return np.asarray(np.linalg.norm(forward(arm, q)[0][:, :3, 3] - frames[:, :3, 3], axis=1))


def solve_all(asked: Asked, args: argparse.Namespace) -> tuple[int, Found]:
    """Print one solution for each branch and interval, the nearest to the seed (or the middle) first.

    Return the exit status, 1 if there is none, and None.
    """
    arm, frame = asked.arm, asked.frame
    seed, name = _seed(asked)
    metric: Any = args.metric or "l2"
    found = arm.solutions(frame, seed, metric=metric, gc=asked.gc)
    branches = [*range(CONFIGURATIONS)] if asked.gc is None else [asked.gc]
    every = arm.feasible(frame)[branches]
    if args.json:
        columns = {key: getattr(found, key) for key in ("q", "psi", "gc", "distance", "margin", "status")}
        show_json(columns | {"unproven": every.unproven, "seed": seed, "metric": metric})
    elif len(found):
        show(f"one solution for each branch and interval, nearest to {name}; all in degrees\n")
        rows = [
            [str(one.gc), degrees(float(one.psi), 0), *(degrees(v, 1) for v in one.q),
             degrees(float(one.distance), 1), degrees(float(one.margin), 1)]
            for one in found
        ]  # fmt: skip
        show(table(["gc", "psi", *_COLUMNS, metric, "margin"], rows))
    named = zip([f"gc {gc}" for gc in branches], np.ravel(every.unproven).tolist(), strict=True)
    unproven = left_out(named)
    if unproven:
        note(f"armangle: {unproven}")
    if not len(found):
        assert isinstance(found.status, Status)
        note(f"armangle: {unsolved_text(arm, frame, asked.gc or 0, found.status)}")
    return 0 if len(found) else 1, None


def solve_at_psi(asked: Asked, args: argparse.Namespace) -> tuple[int, Found]:
    """Print the solution of an arm angle and a branch, or with --all those of all branches.

    Returns the exit status, and for one branch psi and gc if every pose has a solution.
    """
    if args.all:
        return _every_branch(asked, args.psi, args.json), None
    arm, psi, gc = asked.arm, args.psi, args.gc
    with progress("solving"):
        path = _rows(asked, psi, gc)
    if args.output is not None:
        write(path, args.output)
    if args.json:
        values = {key: getattr(path, key)[asked.pick] for key in ("q", "psi", "gc", "margin")}
        show_json(values | {"status": _NAMES[path.status][asked.pick], "redundancy": arm.redundancy})
    elif asked.frame.ndim == 3:
        show_many(path.q, _NAMES[path.status])
    elif path.ok:
        show_configuration(arm, path.q[0], psi, gc)
    if not path.ok:
        note(f"armangle: {_reason(asked, path, psi, gc)}")
    return 0 if path.ok else 1, (psi, gc) if path.ok else None


def _rows(asked: Asked, psi: float, gc: int) -> JointPath:
    """Return the solutions at one arm angle and branch as a path with one row for each pose."""
    arm, frames = asked.arm, asked.frames
    q = arm.inverse(frames, psi, gc, seed=asked.seed, on_error="nan")
    solved = np.isfinite(q).all(axis=1)
    # A pose without any solution has its reason; a pose with one at another arm angle: OUTSIDE.
    rows = blank_rows(len(frames))
    why = np.asarray(arm.feasible(frames[~solved], gc).status)
    rows["status"][~solved] = np.where(why == Status.OK, Status.OUTSIDE, why)
    if isinstance(arm, Arm) and arm.geometry.chain is not None:
        held = np.isfinite(arm.inverse(frames, psi, gc, seed=asked.seed, on_error="nan", limits=False)).all(
            axis=1
        )
        rows["status"][~held & (rows["status"] == Status.OUTSIDE)] = Status.NEAR_SINGULAR
    if solved.any():
        rows["q"][solved], rows["psi"][solved], rows["gc"][solved] = q[solved], psi, gc
        rows["status"][solved], rows["margin"][solved] = Status.OK, arm.limit_margin(q[solved])
        rows["residual"][solved] = _off(arm, q[solved], frames[solved])
    return JointPath(arm=arm, s=even_parameters(len(frames)), poses=frames, **rows)


def _reason(asked: Asked, path: JointPath, psi: float, gc: int) -> str:
    """Return in words why the first unsolved pose has no solution."""
    arm, at = asked.arm, path.first_failure or 0
    failed = int((path.status != Status.OK).sum())
    where = "" if len(path) == 1 else f"{failed} of {len(path)} poses fail; pose {at}: "
    if path.status[at] != Status.OUTSIDE:
        return where + unsolved_text(arm, path.poses[at], gc, STATUSES[path.status[at]])
    q = arm.inverse(path.poses[at], psi, gc, seed=asked.seed, on_error="nan", limits=False)
    found = arm.feasible(path.poses[at], gc)
    intervals = ", ".join(f"[{degrees(low, 2)}, {degrees(high, 2)}]" for low, high in found)
    outside = violations(arm, q) or "no joints reach the pose with it"
    not_feasible = f"psi {degrees(psi, 2)} deg is not feasible: {outside}"
    return f"{where}{not_feasible}. Feasible with gc {gc}: {intervals} deg."


def _every_branch(asked: Asked, psi: float, as_json: bool) -> int:
    """Print the solutions of all eight branches; those outside their limits with the violations."""
    arm, pose = asked.arm, asked.frame
    q8 = arm.inverse(pose, psi, seed=asked.seed, on_error="nan", limits=False)
    known = np.isfinite(q8[:, 0])  # near singularities some branches of an own chain may have no solution
    if not known.any():
        why = Status(int(arm.feasible(pose, 0).status))
        note(f"armangle: {unsolved_text(arm, pose, 0, Status.NEAR_SINGULAR if why == Status.OK else why)}")
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
        show(table(["gc", *(f"{name} " for name in _COLUMNS)], rows))
    if not known.all():
        listed = ", ".join(map(str, np.flatnonzero(~known)))
        note(f"armangle: gc {listed}: {Status.NEAR_SINGULAR.sentence}")
    if not np.any(within):
        note("armangle: no global configuration is within the limits at this arm angle")
    return 0 if np.any(within) else 1
