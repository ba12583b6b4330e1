"""Joint paths one after the other: everything about the whole is what its parts say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.moves import moved, refused
from support.needs import need

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])


def three() -> list[aa.JointPath]:
    """A plan along a line, a followed motion and a plan along poses, each from the end of the one before."""
    a = ARM.forward(Q)[0]
    b, c, d = (moved(a, by) for by in ([0.0, -0.12, 0.02], [-0.05, -0.12, -0.08], [-0.05, 0.0, -0.08]))
    first = aa.plan(ARM, aa.Line(a, b), start=Q, samples=50)
    second = aa.follow(ARM, aa.Line(b, c).pose(np.linspace(0, 1, 31)), start=first.q[-1], policy=aa.Hold())
    third = aa.plan(ARM, np.stack([c, d, c]), start=second.q[-1])
    return [first, second, third]


def test_the_whole_is_its_parts() -> None:
    """`join`: joints, poses, psi and derivatives are those of the parts, s scaled by their numbers of
    rows.
    """
    parts = three()
    whole = aa.join(parts)
    counts = np.array([len(part) - 1 for part in parts])
    ends = np.concatenate([[0], np.cumsum(counts)]) / counts.sum()
    assert len(whole) == counts.sum() + 1
    assert whole.ok and not whole.certified
    assert (np.diff(whole.s) > 0).all() and whole.s[0] == 0 and whole.s[-1] == 1
    inner = np.linspace(0, 1, 101)[1:-1] + 3.7e-4  # between the rows
    for part, low, high in zip(parts, ends[:-1], ends[1:], strict=True):
        at, own = whole.at(low + (high - low) * inner), part.at(inner)
        np.testing.assert_allclose(at.q, own.q, atol=1e-9)
        np.testing.assert_allclose(at.pose, own.pose, atol=1e-12)
        np.testing.assert_array_equal(at.gc, own.gc)
        np.testing.assert_allclose(np.exp(1j * at.psi), np.exp(1j * own.psi), atol=1e-9)
        rates = whole.derivatives(low + (high - low) * inner)
        np.testing.assert_allclose(
            rates[:, 0] * (high - low), part.derivatives(inner)[:, 0], rtol=1e-6, atol=1e-7
        )
    rows = whole.at(whole.s)
    np.testing.assert_allclose(rows.q, whole.q, atol=1e-6)
    np.testing.assert_allclose(ARM.forward(whole.q)[0], whole.poses, atol=1e-6)
    assert np.abs(np.diff(whole.psi)).max() < np.pi
    assert whole.uncertified.min() == pytest.approx(ends[1]) and whole.uncertified.max() <= 1


def test_plans_that_are_proven_are_proven_as_one() -> None:
    """`join` of certified plans is certified."""
    first, _, third = three()
    whole = aa.join([third, aa.plan(ARM, aa.Line(third.poses[-1], third.poses[1]), start=third.q[-1])])
    assert whole.certified and len(whole.uncertified) == 0
    assert whole.explain().endswith("within all limits, and proven between them.")
    assert aa.join([first]).certified


@pytest.mark.parametrize("roll", ["pose", "free"])
def test_rounded_corners_are_said_joined_and_with_free_roll(roll: Any) -> None:
    """`plan`, `follow` and `join` with blend state the deviation at rounded corners, with free roll too."""
    arm = aa.Arm.from_catalogue("kuka_iiwa14_r820")
    arm = arm.with_tool(aa.pose([0.05, 0, 0.2], rpy=[0, 0.5, 0]))  # its z axis is not axis 7
    a, b, c = (aa.pose([x, y, 0.12], rpy=[np.pi, 0, 0]) for x, y in ((0.45, -0.15), (0.45, 0), (0.55, 0)))
    lines = [aa.Line(a, b), aa.Line(b, c)]
    rounded = aa.Segments(lines, 0.02).deviation
    assert rounded.position > 1e-3
    planned = aa.plan(arm, lines, blend=0.02, roll=roll)
    assert planned.certified
    followed = aa.follow(arm, lines, start=planned.q[0], blend=0.02, roll=roll)
    for path in (planned, followed, aa.join([planned])):
        assert path.deviation == rounded
        assert "Corners are rounded by at most" in path.explain()


def test_it_is_saved_and_timed_as_one(tmp_path: Path) -> None:
    """A joined path can be saved and loaded, and retimed within its acceleration."""
    need("scipy")
    whole = aa.join(three())
    aa.io.save(whole, tmp_path / "whole.csv")
    np.testing.assert_array_equal(aa.io.load_joints(tmp_path / "whole.csv").q, whole.q)
    timed = aa.retime(whole, acceleration=5.0)
    at = timed.at(np.linspace(0, timed.duration, 3000))
    assert np.abs(at.qdd).max() <= 5.0 * (1 + 1e-3)
    assert at.s[-1] == pytest.approx(1, abs=1e-9)


def test_what_does_not_join_is_refused() -> None:
    """`join` refuses paths that do not meet, of other arms, not solved, or without rows."""
    (first, _, third), other = three(), aa.Arm.from_catalogue("kuka_iiwa14_r820")
    far = first.poses.copy()
    far[:, 0, 3] += 3.0
    for error, said, parts in (
        (aa.InputError, "path 1 begins .* rad and .* m from where path 0 ends", [first, third]),
        (aa.InputError, "path 1 is of another arm",
         [first, aa.follow(other, other.forward(np.stack([Q, Q]))[0], start=Q)]),
        (aa.PathError, "path 0 is not solved", [aa.follow(ARM, far, start=Q)]),
        (aa.InputError, "path 1 has no rows", [first, aa.follow(ARM, first.poses[:0], start=Q)]),
    ):  # fmt: skip
        refused(error, said, aa.join, parts)


def test_what_stands_about_stays_known() -> None:
    """`join` keeps one scene, or one a row; none if a part has none."""
    arm = ARM.with_(body=aa.Body.bones(upper_arm=0.06, forearm=0.05))
    scene, other = (aa.Scene([aa.Ball([0, place, 0.3], 0.05, name="post")]) for place in (-0.9, 0.9))
    a, b = arm.forward(Q)[0], arm.forward(Q)[0]
    b[1, 3] -= 0.1
    first = aa.plan(arm.with_(scene=scene), aa.Line(a, b), start=Q, samples=20)
    back = {
        key: aa.plan(arm.with_(scene=key), aa.Line(b, a), start=first.q[-1], samples=20)
        for key in (scene, other, None)
    }
    both = aa.join([first, back[scene]])
    assert both.scenes == (scene,)
    assert both.closest is not None and first.closest is not None
    assert both.clearance.min() == min(first.clearance.min(), back[scene].clearance.min())
    mixed = aa.join([first, back[other]])
    assert mixed.scenes == (scene,) * len(first) + (other,) * (len(mixed) - len(first))
    assert both.arm == first.arm and mixed.arm == arm
    assert aa.join([first, back[None]]).scenes == ()
