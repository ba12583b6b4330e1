"""What most tests of motions begin with: poses that are moved, lines, limits, trackers, and refusals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import armangle as aa

Array = np.ndarray
DENSE = np.linspace(0, 1, 5001)


def moved(pose: Array, by: Any) -> Array:
    """A pose with its position moved by a vector (m)."""
    out = np.array(pose)
    out[:3, 3] += by
    return out


def line(arm: Any, q: Any, shift: Any, back: bool = False) -> aa.Line:
    """A line of the tool by a vector (m) from the pose of joints q, or to it if `back`."""
    first = np.asarray(arm.forward(np.asarray(q, float), on_error="nan")[0])
    last = moved(first, shift)
    return aa.Line(last, first) if back else aa.Line(first, last)


def along(pose: Array, by: Any, count: int) -> Array:
    """Poses (count, 4, 4) from a pose on, evenly spaced over a vector (m)."""
    out = np.repeat(np.asarray(pose)[None], count, axis=0)
    out[:, :3, 3] += np.linspace(0, 1, count)[:, None] * np.asarray(by)
    return out


def limited(arm: Any, joint: int, lower: float | None = None, upper: float | None = None) -> Any:
    """The arm with other limits of one joint (0 to 6), rad."""
    limits = {"lower": arm.lower.copy(), "upper": arm.upper.copy()}
    for side, value in (("lower", lower), ("upper", upper)):
        if value is not None:
            limits[side][joint] = value
    return arm.with_(**limits)


def begun(start: Any, *words: Any, **options: Any) -> aa.Tracker:
    """A tracker with these arguments, at rest at the joints `start`."""
    tracker = aa.Tracker(*words, **options)
    tracker.start(start)
    return tracker


def refused(
    error: type[BaseException], said: str, call: Callable[..., object], *words: Any, **options: Any
) -> None:
    """Check that a call raises this error with a message in which the pattern `said` is found."""
    with pytest.raises(error, match=said):
        call(*words, **options)


def proven(result: aa.JointPath, start: Any = None, goal: Any = None, s: Array = DENSE) -> aa.types.PathPoint:
    """Check that a plan is certified, and that ends, pose, limits and continuity are as promised. Return its
    points at s.
    """
    assert result.certified, result.explain()
    arm, here = result.arm, result.at(s)
    for row, end in ((0, start), (-1, goal)):
        if end is not None:
            np.testing.assert_allclose(here.q[row], end, atol=1e-9)
    np.testing.assert_allclose(arm.forward(here.q, on_error="nan")[0], here.pose, atol=1e-11)
    if result.path is not None:
        np.testing.assert_allclose(here.pose, result.path.pose(s), atol=1e-11)
    assert arm.within_limits(here.q, 1e-9).all()
    speed = np.nanmax(np.abs(result.derivatives(s)[:, 0]), initial=0.0)
    assert np.abs(np.diff(here.q, axis=0)).max(initial=0.0) <= 1.5 * speed / (len(s) - 1) + 1e-9
    return here


def slopes_hold(result: aa.JointPath, s: Any, h: float = 1e-6, atol: float = 1e-5) -> None:
    """Check the first derivatives against finite differences of the joints."""
    s = np.atleast_1d(s)
    around = (result.at(s + h).q - result.at(s - h).q) / (2 * h)
    np.testing.assert_allclose(result.derivatives(s)[:, 0], around, atol=atol, rtol=atol)


def just_inside(
    result: aa.JointPath, joints: Any = range(7), where: Any = None, loose: float | None = 1e-3
) -> int:
    """Check that the certificate of a plan's curve fails at a joint's extreme if a limit is 1e-6 rad inside
    of it, and holds there if it is `loose` (rad; None: not tried) outside. Return how many limits were tried.

    `where(row)` says whether an extreme at this row of DENSE counts.
    """
    x, q, found = result.curve, result.at(DENSE).q, 0
    for joint in joints:
        for side, at, sign in (("lower", q[:, joint].argmin(), 1), ("upper", q[:, joint].argmax(), -1)):
            if where is not None and not where(at):
                continue
            found += 1
            for inset, is_proven in ((1e-6, False), *([(-loose, True)] if loose else [])):
                arm = limited(result.arm, joint, **{side: q[at, joint] + sign * inset})
                open_, _ = arm._handle.certify_curve(x.segments, x.stretches, x.plane, x.gc, 0.0)
                assert any(low <= DENSE[at] <= high for low, high in open_) != is_proven, (joint, side)
    return found


def in_a_loop(
    arm: Any, poses: Any, start: Array, on_fail: Any = "stop", velocity_now: Any = None, **options: Any
) -> aa.JointPath:
    """Follow poses, check that q, margin, gc and status equal those of `step` in a loop, and return the
    motion.
    """
    bounded = "acceleration" in options or velocity_now is not None
    velocity = np.zeros(7) if velocity_now is None else velocity_now
    given = {"velocity_now": velocity_now} if velocity_now is not None else {}
    path = aa.follow(arm, poses, start=start, on_fail=on_fail, **given, **options)
    q, stopped = start, False
    for row, pose in enumerate(poses):
        if stopped:
            assert path.status[row] == aa.Status.NOT_REACHED and np.isnan(path.q[row]).all()
            continue
        now = aa.step(arm, q, pose, **options, **({"velocity_now": velocity} if bounded else {}))
        assert path.status[row] == (now.status if on_fail == "hold" else now.why)
        if now.status == aa.Status.OK or on_fail == "hold":
            assert np.array_equal(path.q[row], now.q)
            assert path.margin[row] == now.margin and path.gc[row] == now.gc
            assert abs(np.exp(1j * path.psi[row]) - np.exp(1j * now.psi)) <= 1e-14
        else:
            assert np.isnan(path.q[row]).all() and path.gc[row] == -1
        stopped = now.status != aa.Status.OK and on_fail == "stop"
        velocity, q = (now.q - q) / options.get("dt", 1.0), now.q
    return path
