"""`armangle ik` without an arm angle: the nearest posture of each pose, or one for each branch and arc."""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np

from .._arrays import CONFIGURATIONS, Floats, millimetres
from ..arm.arm import Arm
from ..arm.solution import Solution
from ..errors import InputError
from ..motion.joint_path import JointPath, even_parameters
from ..scenes.scene import Scene
from ..status import STATUSES, Status
from .arguments import joints
from .messages import note, paragraph
from .screen import (
    counted,
    degrees,
    left_out,
    progress,
    show,
    show_json,
    show_many,
    show_posture,
    unsolved_text,
    write,
)
from .tables import table


def solve(arm: Arm, pose: Floats, scene: Scene | None, args: argparse.Namespace) -> int:
    """Print what is nearest to --near, or to the middle of the ranges; status 1 where there is no posture."""
    _check(args, pose.ndim == 2)
    if args.near is None:
        near, name = np.array(arm._handle.joint_middle), "the middle of the joint ranges"
    else:
        near, name = joints("--near", args.near, arm), "--near"
    if args.all:
        return _all(arm, pose, near, name, scene, args)
    single, frames = pose.ndim == 2, pose.reshape(-1, 4, 4)
    with progress("solving"):
        found = arm.solve(
            frames, near, metric=args.metric, gc=args.gc, scene=scene, outside=args.outside, roll=args.roll
        )
    if args.output is not None:
        write(_path(arm, frames, found), args.output)
    names = np.array([status.name for status in STATUSES])[found.status]
    if args.json:
        pick = 0 if single else slice(None)
        values = {key: getattr(found, key)[pick] for key in ("q", "psi", "gc", "distance", "margin", "gap")}
        show_json(values | {"status": names[pick], "near": near, "metric": args.metric})
    elif not single:
        show(f"nearest to {name}\n")
        show_many(found.q, names)
        unproven = int((names == Status.UNPROVEN.name).sum())
        if unproven:
            show(paragraph(f"\nUNPROVEN, {counted(unproven, 'pose')}: {Status.UNPROVEN.sentence}"))
    elif np.isfinite(found.q).all():
        one = found.row(0)
        show_posture(arm, one.q, float(one.psi), int(one.gc))
        show(f"\nnearest to {name}:\n{_far(args.metric, float(one.distance))}")
        if one.status == Status.UNPROVEN:
            show(paragraph(f"UNPROVEN: {Status.UNPROVEN.sentence}"))
        if not one.ok:
            off = millimetres(float(one.gap))
            show("\nof the nearest pose that can be held:")
            show(f"{off} from the one asked; a radian counts as 200 mm")
    if np.all(found.ok):
        return 0
    failed = np.flatnonzero(~np.asarray(found.ok))
    where = "" if single else f"{len(failed)} of {len(frames)} poses fail; pose {failed[0]}: "
    why = STATUSES[int(np.ravel(found.status)[failed[0]])]
    note(f"armangle: {where}{unsolved_text(arm, frames[failed[0]], args.gc or 0, why)}")
    return 1


def _all(
    arm: Arm, pose: Floats, near: Floats, name: str, scene: Scene | None, args: argparse.Namespace
) -> int:
    """Print one posture for each branch and arc, the nearest first."""
    found = arm.solutions(pose, near, metric=args.metric, gc=args.gc, scene=scene)
    asked = [*range(CONFIGURATIONS)] if args.gc is None else [args.gc]
    every = arm.feasible_all(pose, scene=scene)[asked]
    if args.json:
        columns = {key: getattr(found, key) for key in ("q", "psi", "gc", "distance", "margin", "status")}
        show_json(columns | {"unproven": every.unproven, "near": near, "metric": args.metric})
    elif len(found):
        show(f"one posture for each branch and arc, nearest to {name}; all in degrees\n")
        rows = [
            [str(one.gc), degrees(float(one.psi), 0), *(degrees(v, 1) for v in one.q),
             degrees(float(one.distance), 1), degrees(float(one.margin), 1)]
            for one in found
        ]  # fmt: skip
        show(table(["gc", "psi", *(f"q{i}" for i in range(1, 8)), args.metric, "margin"], rows))
    named = zip([f"gc {gc}" for gc in asked], np.ravel(every.unproven).tolist(), strict=True)
    unproven = left_out(named)
    if unproven:
        note(f"armangle: {unproven}")
    if len(found):
        return 0
    assert isinstance(found.status, Status)
    note(f"armangle: {unsolved_text(arm, pose, args.gc or 0, found.status)}")
    return 1


def _check(args: argparse.Namespace, single: bool) -> None:
    """Raise where options do not go together."""
    if args.seed is not None:
        raise InputError("--seed goes with --psi; without an arm angle wanted --near")
    if args.all and (not single or args.output is not None):
        raise InputError("--all takes one pose and prints it; leave it out for a file of poses or for -o")
    if args.all and args.roll != "pose":
        raise InputError("--all lists the postures of the pose as it is: it goes without --roll free")


def _far(metric: str, distance: float) -> str:
    if metric == "max":
        return f"no joint is further than {degrees(distance, 2)} deg from it"
    return f"{degrees(distance, 2)} deg from it (root of the sum of squares)"


def _path(arm: Arm, frames: Floats, found: Solution) -> JointPath:
    """Return one row a pose, each with its status."""
    residual, ok = np.full(len(frames), np.nan), np.asarray(found.ok)
    reached = arm.forward(found.q[ok], undefined="nan")[0]
    residual[ok] = np.linalg.norm(reached[:, :3, 3] - frames[ok, :3, 3], axis=1)
    rows: dict[str, Any] = {key: getattr(found, key) for key in ("q", "psi", "gc", "status", "margin")}
    return JointPath(arm=arm, s=even_parameters(len(frames)), poses=frames, residual=residual, **rows)
