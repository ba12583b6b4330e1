"""Where the elbow is, and the arm angle that brings it nearest to a point or farthest along a direction."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from support import draw
from support.laws import gap
from support.strategies import Array, all_arms, in_every_regime, postures
from support.threads import in_threads

import armangle as aa

any_arm = pytest.mark.parametrize("arm", all_arms(), ids=lambda arm: arm.name)
PSI = np.linspace(-np.pi, np.pi, 181)
WORDS = {
    "up": [0, 0, 1], "down": [0, 0, -1], "left": [0, 1, 0], "right": [0, -1, 0],
    "forward": [1, 0, 0], "back": [-1, 0, 0],
}  # fmt: skip
IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POSE, PSI_NOW, GC = IIWA.forward(Q)
UPRIGHT = IIWA.forward(np.zeros(7))[0]


def shoulder_and_wrist(arm: aa.Arm, q: Array) -> tuple[Array, Array]:
    """Positions (..., 3) of shoulder and wrist, m, in the frame that poses are given in."""
    frames = arm.frames(q)
    return frames[..., 1, :3, 3], frames[..., 5, :3, 3]


@any_arm
@in_every_regime
def test_the_elbow_is_a_link_from_shoulder_and_wrist(arm: aa.Arm, regime: str) -> None:
    """`Arm.elbow` is the origin of frame 3, at the lengths of the links from shoulder and wrist."""
    q = postures(arm, regime, draw.count(100), 1)
    shoulder, wrist = shoulder_and_wrist(arm, q)
    elbow = arm.elbow(q)
    assert (
        gap(np.linalg.norm(elbow - shoulder, axis=-1), np.hypot(arm.geometry.d_se, arm.geometry.a_3)) <= 1e-14
    )
    forearm = np.hypot(np.hypot(arm.geometry.d_ew, arm.geometry.a_4), arm.geometry.d_4)
    assert gap(np.linalg.norm(elbow - wrist, axis=-1), forearm) <= 1e-14
    axis = arm.frames(q)[:, 3, :3, 2]  # of joint 4
    assert gap(np.einsum("ni,ni->n", elbow - shoulder, axis), 0) <= 1e-14
    assert np.array_equal(elbow, arm.frames(q)[:, 3, :3, 3])


def distances(arm: aa.Arm, pose: Array, gc: Array, psi: Array, point: Array) -> Array:
    """Distances (..., k) of the elbow from a point, m, at psi (..., k)."""
    elbow = arm.elbow(arm.inverse(pose[..., None, :, :], psi, gc[..., None], limits=False))
    return np.asarray(np.linalg.norm(elbow - point[..., None, :], axis=-1))


@pytest.mark.turns(2)
@pytest.mark.slow
@any_arm
@in_every_regime
def test_no_arm_angle_brings_the_elbow_nearer(arm: aa.Arm, regime: str) -> None:
    """No psi brings the elbow nearer to a point than that of `psi_towards`."""
    pose, _, gc = arm.forward(postures(arm, regime, draw.count(40), 2))
    rng = draw.generator(3)
    point = arm.base[:3, 3] + rng.uniform(-1, 1, (len(gc), 3))
    psi = arm.psi_towards(pose, gc, point, on_error="nan")
    defined = ~np.isnan(psi)
    assert defined.any() or regime in ("at_reach", "folded")
    pose, gc, point, psi = pose[defined], gc[defined], point[defined], psi[defined]
    assert ((psi > -np.pi) & (psi <= np.pi)).all()
    nearest = distances(arm, pose, gc, psi[:, None], point)
    assert (nearest <= distances(arm, pose, gc, PSI + psi[:, None], point) + 1e-13).all()
    # stationary: the two sides are alike
    ahead, behind = (distances(arm, pose, gc, psi[:, None] + h, point) for h in (1e-3, -1e-3))
    assert gap(ahead, behind) <= 1e-12


@pytest.mark.turns(2)
@pytest.mark.slow
@any_arm
def test_no_arm_angle_brings_the_elbow_farther_along(arm: aa.Arm) -> None:
    """No psi brings the elbow farther in a direction than that of `psi_towards`."""
    for word in WORDS:
        farthest(arm, word)


def farthest(arm: aa.Arm, word: str) -> None:
    """Check that psi_towards a direction is better than any other arm angle."""
    pose, _, gc = arm.forward(postures(arm, "uniform", draw.count(40), 4))
    psi = arm.psi_towards(pose, gc, direction=word)
    along = np.array(WORDS[word], dtype=float)
    assert np.array_equal(psi, arm.psi_towards(pose, gc, direction=3.0 * along))

    def height(angles: Array) -> Array:
        """The elbow's coordinate (m) along the direction at psi (n, k)."""
        return np.asarray(arm.elbow(arm.inverse(pose[:, None], angles, gc[:, None], limits=False)) @ along)

    best = height(psi[:, None])
    assert (best >= height(PSI + psi[:, None]) - 1e-14).all()
    assert gap(height(psi[:, None] + 1e-3), height(psi[:, None] - 1e-3)) <= 1e-12
    # a point far away is a direction
    far = arm.psi_towards(pose, gc, arm.base[:3, 3] + 999.0 * along)
    assert (height(far[:, None]) >= best - 1e-3).all()


def test_the_elbow_is_its_own_nearest_point() -> None:
    """`psi_towards` the present elbow is the present psi."""
    for arm in all_arms():
        q = postures(arm, "uniform", 50, 5)
        pose, psi, gc = arm.forward(q)
        assert gap(np.sin((arm.psi_towards(pose, gc, arm.elbow(q)) - psi) / 2), 0) <= 1e-9


def test_batches_broadcast_and_agree_with_single_calls() -> None:
    """`psi_towards` and `elbow` broadcast, and equal single calls."""
    pose, _, gc = IIWA.forward(postures(IIWA, "uniform", 6, 6).reshape(2, 3, 7))
    points = np.random.default_rng(1).uniform(-1, 1, (4, 1, 1, 3))
    psi = IIWA.psi_towards(pose, gc, points)
    assert psi.shape == (4, 2, 3)
    assert psi[3, 1, 2] == IIWA.psi_towards(pose[1, 2], gc[1, 2], points[3, 0, 0])
    assert np.array_equal(psi, in_threads(0, lambda: IIWA.psi_towards(pose, gc, points)))
    assert isinstance(IIWA.psi_towards(POSE, GC, direction="up"), np.float64)
    assert IIWA.elbow(Q).shape == (3,) and IIWA.elbow(np.zeros((0, 2, 7))).shape == (0, 2, 3)
    assert IIWA.psi_towards(np.zeros((0, 4, 4)), 0, direction="up").shape == (0,)


def test_both_elbows_of_a_pose_go_to_the_same_place() -> None:
    """`psi_towards` in branches with the elbow bent either way gives the same elbow."""
    psi = IIWA.psi_towards(POSE, [GC, GC ^ 2], direction="up")
    elbows = IIWA.elbow(IIWA.inverse(POSE, psi, [GC, GC ^ 2], limits=False))
    assert gap(elbows[0], elbows[1]) <= 1e-14


def beyond(x: float) -> Array:
    """A pose at x (m) on the x axis."""
    pose = np.eye(4)
    pose[0, 3] = x
    return pose


AXIS = [0.0, 0.0, 0.5]  # on the base axis; the wrist of BENT is there too
BENT = IIWA.forward([0.0, 0.6, 0.0, 1.2, 0.0, 0.6, 0.0])[0]


@pytest.mark.parametrize(
    ("pose", "wish", "message"),
    [
        (UPRIGHT, {"point": [1.0, 0, 0]}, "stretched or folded at pose[1]: psi does not move its elbow"),
        (UPRIGHT, {"direction": "left"}, "stretched or folded at pose[1]"),
        (BENT, {"point": AXIS}, "every psi at pose[1] is as good: the point lies on the axis"),
        (BENT, {"direction": "up"}, "every psi at pose[1] is as good"),
        (beyond(2.0), {"direction": "up"}, "pose[1] is out of reach by"),
    ],
)
def test_where_every_arm_angle_is_alike_it_is_said(pose: Array, wish: dict[str, Any], message: str) -> None:
    """`psi_towards` raises and says why if psi does not matter or the pose is out of reach; NaN on
    request.
    """
    poses = np.stack([POSE, pose])
    with pytest.raises(aa.UnreachableError, match=re.escape(message)):
        IIWA.psi_towards(poses, 0, **wish)
    assert np.isnan(IIWA.psi_towards(poses, 0, **wish, on_error="nan")).tolist() == [False, True]
