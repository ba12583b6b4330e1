"""Derivatives of the inverse, of the arm angle and of arcs: against the Jacobian and against differences."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support import draw
from support.gradients import HOME, calm, moved, named, postures

import armangle as aa
from armangle.models.catalogue import srs_catalogue

NAMES = (
    "kuka_iiwa7_r800", "openarm_v10", "barrett_wam7", "yaskawa_sia10d", "yaskawa_sia5d", "human_arm_left",
)  # fmt: skip
STEP = 1e-4
Values = Callable[[float], np.ndarray]


def slope_of(values: Values, step: float = STEP) -> np.ndarray:
    """The derivative at h = 0 of the angles values(h), rad, by differences of `step` and less with
    Richardson's extrapolation.
    """

    def difference(h: float) -> np.ndarray:
        """The central difference of step h."""
        apart = values(h) - values(-h)
        return ((apart + np.pi) % (2 * np.pi) - np.pi) / (2 * h)

    far, near, nearest = (difference(step / 2**k) for k in range(3))
    inner, outer = (4 * near - far) / 3, (4 * nearest - near) / 3
    return (16 * outer - inner) / 15


def arms() -> list[aa.Arm]:
    """Return arms of the catalogue, one with base and tool, and arms with other elbows."""
    tool, base = (
        aa.pose([0.05, 0.02, 0.1], rpy=[0.3, 0.2, 0.1]),
        aa.pose([0.1, 0.2, 0.3], rpy=[0.5, 0.4, 0.3]),
    )
    own = [aa.Arm.from_catalogue(name) for name in srs_catalogue()]
    mounted = own[0].with_(tool=tool, base=base)
    lengths = {"d_bs": 0.3, "d_se": 0.4, "d_ew": 0.35, "d_wf": 0.1, "a_3": 0.05, "a_4": -0.03, "d_4": 0.04}
    gap = aa.Arm(**lengths, signs=[1, -1] * 3 + [1], offsets=np.linspace(-0.6, 0.6, 7), base=base, tool=tool)
    return [
        *(arm for arm in own if arm.geometry.chain is None),
        mounted,
        mounted.with_(reference="stereographic"),
        mounted.with_(reference=[0.2, 0.5, 0.8]),
        gap,
    ]


def joints_of(arm: aa.Arm, rng: np.random.Generator, count: int) -> np.ndarray:
    """At most `count` joints of an S-R-S arm within 2 rad of 0, no closer to a singularity than 0.2 rad."""
    return calm(arm, rng.uniform(-2, 2, (count, 7)))


@pytest.mark.parametrize("arm", arms(), ids=lambda arm: arm.name or "own")
def test_it_is_the_inverse_of_jacobian_and_the_gradient_of_psi(arm: aa.Arm) -> None:
    """`gradients.inverse` is the matrix inverse of the Jacobian with the row of `gradients.psi`."""
    q = joints_of(arm, draw.generator(17, 3), draw.count(400))
    pose, psi, gc = arm.forward(q)
    inverse = aa.gradients.inverse(arm, pose, psi, gc)
    both = np.concatenate([arm.jacobian(q), aa.gradients.psi(arm, q)[:, None]], axis=1)
    size = np.abs(inverse).max(axis=(1, 2))
    assert (
        np.abs(inverse @ both - np.eye(7)).max(axis=(1, 2)) <= 1e-12 * size * np.abs(both).max((1, 2))
    ).all()
    assert np.allclose(inverse[..., 6], arm.self_motion(pose, psi, gc), rtol=1e-12, atol=1e-12)


def test_it_is_the_limit_of_differences() -> None:
    """`gradients.inverse` equals differences of `inverse` in all branches."""
    rng, branches = draw.generator(17, 4), set()
    for arm in arms():
        q = joints_of(arm, rng, 60)
        pose, psi, gc = arm.forward(q)
        branches |= set(gc)
        slope = aa.gradients.inverse(arm, pose, psi, gc)

        def joints(h: float, at: np.ndarray, arm: aa.Arm = arm, of: tuple = (pose, psi, gc, q)) -> np.ndarray:
            """The joints after a step h of pose and psi along `at` (7,)."""
            return arm.inverse(moved(of[0], h * at[:6]), of[1] + h * at[6], of[2], seed=of[3], limits=False)

        for k, twist in enumerate(np.eye(7)):
            found = slope_of(functools.partial(joints, at=twist))
            size = np.abs(slope).max(axis=(1, 2))[:, None]
            assert (np.abs(slope[:, :, k] - found) <= 1e-7 * np.maximum(1, size)).all()
    assert branches == set(range(8))


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", NAMES)
def test_ends_of_arcs_and_their_sum_move_as_said(name: str) -> None:
    """`gradients.feasible` and `gradients.freedom` equal differences of arc ends and freedom."""
    arm, rng, checked, sums = aa.Arm.from_catalogue(name), draw.generator(17, 5), 0, 0
    step = 1e-4
    for pose in arm.forward(rng.uniform(arm.lower, arm.upper, (draw.count(40), 7)))[0]:
        twist, known, total = rng.normal(size=6), True, 0.0
        places = [step / 2**k * way for k in range(3) for way in (1, -1)]
        for gc in range(8):
            arcs, slopes = aa.gradients.feasible(arm, pose, gc)
            assert slopes.shape == (int(arcs.count), 2, 6) and arcs == arm.feasible(pose, gc)
            near = {h: arm.feasible(moved(pose, h * twist), gc) for h in places}
            alike = all(
                other.count == arcs.count and other.is_full == arcs.is_full and other.ends == arcs.ends
                for other in near.values()
            )
            known &= alike
            if arcs.is_full:
                assert np.isnan(slopes).all()
                continue
            if not alike:
                continue
            said = slopes @ twist
            total += said[:, 1].sum() - said[:, 0].sum()
            found = slope_of(lambda h, sets=near: sets[h].intervals, step)
            calm = np.isfinite(said) & (np.abs(said) < 20)  # a joint that only touches moves as a root does
            known &= bool(calm.all())
            assert (np.abs(said - found)[calm] <= 1e-7 * np.maximum(1, said[calm] ** 2)).all()
            checked += int(calm.sum())
        if known:
            assert aa.gradients.freedom(arm, pose) @ twist == pytest.approx(total, rel=1e-12, abs=1e-12)
            found = slope_of(lambda h, at=pose, by=twist: arm.freedom(moved(at, h * by)).total, step)
            assert abs(total - found) <= 1e-6 * max(1.0, abs(total))
            sums += 1
    assert checked > 100 and sums > 5


def test_a_batch_is_its_elements_to_the_bit_wherever_they_are() -> None:
    """`gradients.inverse` is the same one by one and many, singular and unreachable rows too."""
    rng = draw.generator(17, 8)
    for arm in arms():
        q = rng.uniform(-2, 2, (41, 7))
        q[rng.random((41, 7)) < 0.1] = 0.0  # singular postures between the others
        pose, psi, gc = arm.forward(q, on_error="nan")
        psi = np.nan_to_num(psi)
        pose[7] = aa.pose([9.0, 0.0, 0.0])
        many = aa.gradients.inverse(arm, pose, psi, gc, on_error="nan")
        assert np.isnan(many[7]).all()
        one = [aa.gradients.inverse(arm, *given, on_error="nan") for given in zip(pose, psi, gc, strict=True)]
        assert np.array_equal(many, one, equal_nan=True)


@pytest.mark.parametrize("singular", [0.0, 0.2])
@pytest.mark.parametrize("name", (*NAMES, "franka_fr3", "fetch", "calibrated kinova_movo"))
def test_the_best_margin_moves_as_said(name: str, singular: float) -> None:
    """`gradients.margin` equals differences of the largest margin, also beside a singularity margin."""
    arm, rng = named(name).with_(singularity_margin=singular), draw.generator(17, 9)
    low, high = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    pose = arm.forward(rng.uniform(low, high, (draw.count(60), 7)))[0]
    twist = rng.normal(size=(len(pose), 6))
    said = (aa.gradients.margin(arm, pose) * twist).sum(-1)

    def difference(step: float) -> np.ndarray:
        """The central difference of step h (rad, m)."""
        ends = [arm.solve(moved(pose, way * step * twist), prefer="margin").margin for way in (1, -1)]
        return (ends[0] - ends[1]) / (2 * step)

    coarse, fine = difference(4e-5), difference(2e-5)
    limit = (4 * fine - coarse) / 3
    smooth = np.abs(fine - coarse) < 1e-4 * (1 + np.abs(fine))  # no switch to others within the steps
    known = smooth & np.isfinite(said)
    assert smooth.mean() > 0.8 and known.sum() >= smooth.sum() * (1.0 if arm.kind == "srs" else 0.6)
    off = 1e-7 if arm.kind == "srs" else 1e-5  # searches that compare values know psi to half the digits
    assert (np.abs(said - limit) < off * (1 + np.abs(limit)))[known].all()
    # a joint that cannot be relieved, and two that balance, are both among them
    best = arm.solve(pose, prefer="margin")
    off = np.sort(np.minimum(best.q - arm.lower, arm.upper - best.q), axis=-1)
    assert 0.1 < (off[:, 1] - off[:, 0] < 1e-9).mean() < 0.9


def solution_moves(
    arm: aa.Arm, q: np.ndarray, spread: float, prefer: Any, step: float, off: float, kinks: float
) -> float:
    """Check `gradients.solve` against differences of `step` for poses of joints q and seeds `spread` (rad)
    off them, but for a share `kinks` of kinks. Return the share that has a derivative.
    """
    rng, asked = draw.generator(17, 42), {"weight": [1, 2, 3, 1, 0.5, 1, 2], "prefer": prefer}
    pose = arm.forward(q)[0]
    seed, turn = q + spread * rng.normal(size=q.shape), rng.normal(size=q.shape)
    twist = rng.normal(size=(len(q), 6))
    slopes = aa.gradients.solve(arm, pose, seed, **asked)
    assert slopes.shape == (len(q), 7, 13)
    said = (slopes @ np.concatenate([twist, turn], axis=-1)[..., None])[..., 0]
    ahead, behind = (arm.solve(moved(pose, way * twist), seed + way * turn, **asked) for way in (step, -step))
    difference = (ahead.q - behind.q) / (2 * step)
    held = np.abs(difference).max(axis=-1) < 30  # neither a jump nor beside a singularity
    known = held & np.isfinite(said).all(axis=-1)
    wrong = np.abs(said - difference)[known].max(axis=-1) > off * (1 + np.abs(difference[known]).max(-1))
    assert wrong.mean() < kinks  # a step may cross a kink
    # the joints keep the pose, and follow its twist
    columns, found = slopes[known], arm.solve(pose[known], seed[known], **asked)
    kept, size = arm.jacobian(found.q) @ columns, np.abs(columns).max()
    assert np.abs(kept[..., :6] - np.eye(6)).max() < 1e-9 * size
    assert np.abs(kept[..., 6:]).max() < 1e-9 * size
    assert prefer == "seed" or not columns[..., 6:].any()
    assert known.sum() > 20
    return float(known.sum() / held.sum())


@pytest.mark.parametrize(("prefer", "step", "off"), [("seed", 1e-6, 1e-5), ("margin", 1e-4, 1e-2)])
@pytest.mark.parametrize("name", NAMES[:4])
def test_the_solution_moves_as_said(name: str, prefer: Any, step: float, off: float) -> None:
    """`gradients.solve` equals differences of the solution for pose and seed, but for a few kinks."""
    free, q = postures(name, 150, 17, 41)
    for arm in (free, free.with_(singularity_margin=0.3)):
        known = solution_moves(arm, q, 1.0, prefer, step, off, 0.03)
        assert known > (0.98 if prefer == "seed" else 0.5)


def test_a_solution_without_a_derivative_has_none() -> None:
    """`gradients.solve` is NaN out of reach and at singular solutions; with a scene gradients raise."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    far, singular = aa.pose([9.0, 0, 0]), arm.forward(HOME)[0]
    assert np.isnan(aa.gradients.solve(arm, [far, singular], HOME)).all(axis=(1, 2)).all()
    body = aa.Body.bones(upper_arm=0.09, forearm=0.08)
    guarded = arm.with_(body=body, scene=aa.Scene([aa.Ball([1.0, 0, 0], 0.1)]))
    refused: list[Callable[[], object]] = [
        lambda: aa.gradients.solve(guarded, singular, HOME),
        lambda: aa.gradients.feasible(guarded, singular, 2),
        lambda: aa.gradients.margin(guarded, singular),
    ]
    for ask in refused:
        with pytest.raises(aa.UnsupportedError, match="scene"):
            ask()


def test_the_best_margin_of_what_is_not_held_has_no_gradient() -> None:
    """`gradients.margin` is NaN out of reach, 0 if a joint is locked, and takes gc and no poses."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    assert np.isnan(aa.gradients.margin(arm, aa.pose([9.0, 0, 0]))).all()
    assert aa.gradients.margin(arm, np.empty((0, 4, 4))).shape == (0, 6)
    pose = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0]
    assert np.isfinite(aa.gradients.margin(arm, pose, gc=[1, 3])).all()
    locked = arm.with_(
        lower=[*arm.lower[:2], 0.2, *arm.lower[3:]], upper=[*arm.upper[:2], 0.2, *arm.upper[3:]]
    )
    assert np.abs(aa.gradients.margin(locked, pose)).max() < 1e-9  # joint 3 stays on both of its limits


def test_where_the_best_posture_is_singular_the_gradient_is_true_or_none() -> None:
    """Where the solution of largest margin is singular `gradients.margin` is right or NaN."""
    rng, singular, none, step = draw.generator(17, 10), 0, 0, 1e-6
    for k in range(draw.count(60)):
        middle = rng.uniform(-0.6, 0.6, 7) * (k % 3 > 0)
        half = rng.uniform(0.8, 2.0, 7)
        arm = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126, lower=middle - half, upper=middle + half)
        q = rng.uniform(arm.lower, arm.upper)
        q[[[1], [5], [1, 5]][k % 3]] = 0.0
        if not arm.within_limits(q) or abs(q[3]) < 0.3:
            continue
        pose = arm.forward(q, on_error="nan")[0]
        best = arm.solve(pose, prefer="margin")
        if np.abs(np.sin(best.q[[1, 5]])).min() > 1e-9:
            continue
        singular += 1
        slope = aa.gradients.margin(arm, pose)
        if np.isnan(slope).any():
            none += 1
            continue
        for twist in rng.normal(size=(6, 6)):
            for way in (1, -1):
                found = arm.solve(moved(pose, way * step * twist), prefer="margin").margin - best.margin
                assert abs(way * found / step - slope @ twist) < 1e-3 * (1 + np.abs(slope).max())
    assert singular > 15 and 0 < none < singular


def test_where_psi_jumps_there_is_no_derivative() -> None:
    """With the wrist over the base axis `gradients.psi` is infinite, unless the reference is another."""
    # the wrist over the base axis, the elbow bent: psi of that axis jumps there
    bent = np.array([0.3, 0.0, 0.2, -1.2, 0.1, 0.7, 0.4])
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(d_se=0.4, d_ew=0.4)
    bent[1] = 0.6  # theta_2 = -theta_4 / 2 brings the wrist of equal links over the shoulder
    bent[2] = np.pi
    pose, psi, gc = arm.forward(bent)
    assert np.hypot(*pose[:2, 3] - 0.126 * pose[:2, 2]) < 1e-9
    assert np.isinf(aa.gradients.psi(arm, bent)).all()
    slope = aa.gradients.inverse(arm, pose, psi, gc)
    turning = [0, 1, 2, 4, 5, 6]
    assert (
        np.isinf(slope[turning, :6]).all() and np.isfinite(slope[3]).all() and np.isfinite(slope[:, 6]).all()
    )
    other = arm.with_(reference=[0.2, 0.5, 0.8])
    assert np.isfinite(aa.gradients.inverse(other, *other.forward(bent))).all()


def test_where_a_derivative_does_not_exist_it_is_infinite() -> None:
    """`gradients.inverse` is infinite for the joints that a singularity leaves open; out of reach it
    raises.
    """
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    home = [0.0, 0.0, 0.0, -1.5, 0.0, 1.0, 0.0]
    slope = aa.gradients.inverse(arm, *arm.forward(home))
    assert np.isinf(slope[:3]).all() and np.isfinite(slope[3:]).all()
    straight = [0.3, 0.5, 0.2, 0.0, 0.1, 0.7, 0.4]
    assert np.isinf(aa.gradients.inverse(arm, *arm.forward(straight))[:, :6]).all()
    with pytest.raises(aa.UnreachableError):
        aa.gradients.inverse(arm, aa.pose([9.0, 0, 0]), 0.0, 0)
    assert aa.gradients.inverse(arm, np.empty((0, 4, 4)), 0.0, 0).shape == (0, 7, 7)
    assert aa.gradients.psi(arm, np.zeros((3, 0, 7))).shape == (3, 0, 7)


# -- arms with an offset, and own chains -----------------------------------------------------------

OFFSET = ("franka_fr3", "ufactory_xarm7", "fetch", "willow_garage_pr2_left")
NEAR = "calibrated kinova_movo"
OWN = ("calibrated franka_fr3", "calibrated fetch")


def mounted(name: str) -> aa.Arm:
    """An arm of `named` on a tilted base, with a tilted tool."""
    base, tool = (
        aa.pose([0.1, 0.2, 0.3], rpy=[0.5, 0.4, 0.3]),
        aa.pose([0.05, 0.02, 0.1], rpy=[0.3, 0.2, 0.1]),
    )
    return named(name).with_(base=base, tool=tool)


def with_psi(arm: aa.Arm, q: np.ndarray) -> np.ndarray:
    """The Jacobian with the gradient of psi as a seventh row, which picks the free joint if there is one."""
    if arm.redundancy == "arm_angle":
        row = aa.gradients.psi(arm, q)[..., None, :]
    else:
        row = np.broadcast_to(np.eye(7)[int(arm.redundancy[-1]) - 1], (*q.shape[:-1], 1, 7))
    return np.concatenate([arm.jacobian(q), row], axis=-2)


def regular(arm: aa.Arm, rng: np.random.Generator, count: int) -> np.ndarray:
    """At most `count` joints within the limits, away from singularities."""
    lower, upper = np.clip(arm.lower, -3, 3), np.clip(arm.upper, -3, 3)
    q = lower + rng.uniform(0.1, 0.9, (20 * count, 7)) * (upper - lower)
    return q[np.linalg.cond(with_psi(arm, q)) < 50][:count]


@pytest.mark.parametrize("name", (*OFFSET, NEAR))
def test_joints_follow_pose_and_psi(name: str) -> None:
    """`gradients.inverse` equals differences, and the inverse of the Jacobian with the row of psi."""
    arm = mounted(name)
    q = regular(arm, draw.generator(17, 51), 60)
    pose, psi, gc = arm.forward(q)
    slope = aa.gradients.inverse(arm, pose, psi, gc)
    assert len(q) == 60 and np.abs(slope @ with_psi(arm, q) - np.eye(7)).max() < 1e-11
    assert np.allclose(slope[..., 6], arm.self_motion(pose, psi, gc), atol=1e-9)
    for k in range(7):
        twist, turn = np.eye(7)[k, :6], float(k == 6)

        def at(h: float, twist: np.ndarray = twist, turn: float = turn) -> np.ndarray:
            """The joints after a step h."""
            return arm.inverse(moved(pose, h * twist), psi + h * turn, gc, seed=q, limits=False)

        assert np.allclose(slope_of(at, 1e-4), slope[..., k], rtol=0, atol=1e-6 * np.abs(slope).max())


@pytest.mark.turns(4)
@pytest.mark.parametrize(
    ("prefer", "step", "off", "kinks"), [("seed", 1e-4, 1e-4, 0.03), ("margin", 1e-4, 1e-2, 0.1)]
)
@pytest.mark.parametrize("name", (*OFFSET, *OWN, NEAR))
def test_its_solution_moves_as_said(name: str, prefer: Any, step: float, off: float, kinks: float) -> None:
    """`gradients.solve` equals differences, but for a few kinks."""
    free = mounted(name)
    q = regular(free, draw.generator(17, 52), 40)
    for arm in (free, free.with_(singularity_margin=0.2)) if name == NEAR else (free,):
        known = solution_moves(arm, q, 0.3, prefer, step, off, kinks)
        assert known > (0.8 if prefer == "seed" else 0.5)


@pytest.mark.parametrize("name", OFFSET)
def test_it_has_no_derivative_where_two_joints_turn_about_one_axis(name: str) -> None:
    """At a singularity of an offset arm `gradients.inverse` is infinite but for the free joint."""
    arm = mounted(name)
    free = int(arm.redundancy[-1]) - 1
    q = np.clip([0.3, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5], arm.lower + 0.1, arm.upper - 0.1)
    hinge = 1 if free == 6 else 5
    q[hinge] = -arm.geometry.offsets[hinge] * arm.geometry.signs[hinge]
    pose, psi, gc = arm.forward(q)
    slope = aa.gradients.inverse(arm, pose, psi, gc)
    others = np.arange(7) != free
    assert np.isinf(slope[others]).all() and np.array_equal(slope[free], np.eye(7)[6])
    far = aa.pose([9.0, 0, 0])
    assert np.isnan(aa.gradients.inverse(arm, far, 0.0, 0, on_error="nan")).all()
    with pytest.raises(aa.UnreachableError):
        aa.gradients.inverse(arm, far, 0.0, 0)
    assert np.isnan(aa.gradients.solve(arm, far, q)).all()
