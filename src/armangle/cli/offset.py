"""`armangle ik` and `fk` of an arm with an offset wrist or shoulder, by its free joint in place of psi."""

from __future__ import annotations

import argparse

import numpy as np

from .._arrays import Floats
from ..arm.offset import OffsetArm
from ..errors import InputError
from ..poses import COLUMNS, rows_from_poses
from ..status import STATUSES
from .arguments import joints
from .messages import note
from .screen import called, degrees, fixed, progress, show, show_joints, show_json, show_many, violations
from .tables import paint

_NOT_IK = ("kuka", "psi", "explain", "all", "scene", "body", "hand", "clearance", "seed", "output")
_NOT_FK = ("kuka", "output")


def solve_offset(arm: OffsetArm, pose: Floats, args: argparse.Namespace) -> int:
    """Print what is nearest to --near, or to the middle of the ranges; status 1 where there is no posture."""
    _refuse(arm, args, _NOT_IK)
    if (args.metric, args.outside, args.roll) != ("l2", "refuse", "pose"):
        raise InputError(f"--metric, --outside and --roll do not go with {called(arm)}")
    near = None if args.near is None else joints("--near", args.near, arm)
    single, frames = pose.ndim == 2, pose.reshape(-1, 4, 4)
    with progress("solving"):
        found = arm.solve(frames, near, gc=args.gc)
    names = np.array([status.name for status in STATUSES])[found.status]
    if args.json:
        pick = 0 if single else slice(None)
        values = {key: getattr(found, key)[pick] for key in ("q", "free", "gc", "distance", "margin")}
        show_json(values | {"status": names[pick], "free_joint": arm.free_joint})
    elif not single:
        show_many(found.q, names)
    elif np.all(found.ok):
        branch = int(np.ravel(found.gc)[0])
        show(f"{paint('gc', 'bold')} {branch}, joint {arm.free_joint} takes the place of psi\n")
        show_joints(arm, found.q[0])
    failed = np.flatnonzero(~np.asarray(found.ok))
    if not len(failed):
        return 0
    where = "" if single else f"{len(failed)} of {len(frames)} poses fail; pose {failed[0]}: "
    note(f"armangle: {where}{STATUSES[int(np.ravel(found.status)[failed[0]])].sentence}")
    return 1


def place_offset(arm: OffsetArm, q: Floats, args: argparse.Namespace) -> int:
    """Print where joints lead; status 1 where they are outside their limits."""
    _refuse(arm, args, _NOT_FK)
    pose, free, gc = arm.forward(q)
    within = arm.within_limits(q)
    if args.json:
        seven = rows_from_poses(pose.reshape(-1, 4, 4)).reshape(*np.shape(free), len(COLUMNS))
        facts = {"pose": seven, "matrix": pose, "free": free, "gc": gc, "within_limits": within}
        show_json(facts | {"free_joint": arm.free_joint})
    else:
        for row in rows_from_poses(pose.reshape(-1, 4, 4)):
            show(",".join(fixed(value, 7) for value in row))
        if q.ndim == 1:
            show(f"\n{paint('gc', 'bold')} {int(gc)}, joint {arm.free_joint} {degrees(float(free))} deg")
    if not np.all(within):
        first = int(np.argmin(np.atleast_1d(within)))
        note(f"armangle: outside its limits: {violations(arm, np.atleast_2d(q)[first])}")
    return 0 if np.all(within) else 1


def _refuse(arm: OffsetArm, args: argparse.Namespace, options: tuple[str, ...]) -> None:
    """Raise for what this kind of arm cannot be asked."""
    for option in options:
        if getattr(args, option) not in (None, False):
            raise InputError(f"--{option} does not go with {called(arm)}")
