"""E1, Status and Turn of KUKA's controllers: there and back, arcs, and a frame taught on a robot."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from support import draw

import armangle as aa
from armangle import kuka

KUKAS = [name for name in aa.catalogue() if name.startswith("kuka_")]
# A frame taught on an iiwa 7 with a media flange (wrist to flange 0.152 m), of the public project
# WerthersEchte/LegoArmCode: mm, rad, and the joints that the same project shows for it, degrees.
TAUGHT_XYZ = np.array([452.42385876038577, 348.36217544715095, 283.1412480812374]) / 1e3
TAUGHT_ABC = [-1.5508203797342421, 0.012741977250006269, 3.1400739722045863]
TAUGHT_E1, TAUGHT_STATUS, TAUGHT_TURN = -0.10968969306569962, 2, 76
TAUGHT_Q = [41.83, 36.92, -6.28, -87.49, 5.36, 55.51, -57.36]


def joints_of(arm: aa.Arm, rng: np.random.Generator, count: int) -> np.ndarray:
    q = rng.uniform(arm.lower, arm.upper, (count, 7))
    q[: count // 20, 1] = 0.0
    q[count // 20 : count // 10, 2] = 0.0
    q[count // 10 : count // 8, :] *= [0, 1, 0, 1, 0, 1, 0]
    return q


@pytest.mark.parametrize("name", KUKAS)
def test_pose_e1_and_status_give_the_joints_back(name: str) -> None:
    arm = aa.Arm.from_catalogue(name)
    q = joints_of(arm, draw.generator(17, 1), draw.count(2000))
    pose = arm.forward(q, undefined="nan")[0]
    back = kuka.from_e1(arm, pose, kuka.to_e1(arm, q), kuka.status(arm, q), seed=q)
    assert np.abs(back - q).max() < 1e-6  # beside A2 = A4 = 0 no better than the pose's own rounding
    calm = (np.abs(np.sin(q[:, [1, 3, 5]])) > 1e-2).all(axis=1)
    assert np.abs(back - q)[calm].max() < 1e-10
    signed = calm & (np.abs(q) > 1e-9).all(axis=1)
    assert np.array_equal(kuka.turn(arm, back)[signed], kuka.turn(arm, q)[signed])


def test_a_frame_taught_on_a_robot() -> None:
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(d_wf=0.152)
    frame = kuka.KukaFrame(kuka.pose(TAUGHT_XYZ, TAUGHT_ABC), TAUGHT_E1, TAUGHT_STATUS, TAUGHT_TURN)
    q = kuka.from_frame(arm, frame)
    assert np.degrees(q).round(2).tolist() == TAUGHT_Q
    again = kuka.to_frame(arm, q)
    assert (again.status, again.turn) == (TAUGHT_STATUS, TAUGHT_TURN)
    assert np.allclose(again.pose, frame.pose, rtol=0, atol=1e-12)
    assert np.allclose(kuka.abc(frame.pose), TAUGHT_ABC, rtol=0, atol=1e-12)
    with pytest.raises(
        aa.ConfigurationError, match=r"turn is 77, but pose, E1 and Status give 76: A1 differ"
    ):
        kuka.from_frame(arm, frame._replace(turn=77))


@pytest.mark.parametrize("name", KUKAS)
def test_a_frame_with_a6_at_zero_is_read(name: str) -> None:
    arm, rng = aa.Arm.from_catalogue(name), draw.generator(17, 6)
    for q in rng.uniform(arm.lower, arm.upper, (draw.count(60), 7)):
        q[[5, *rng.choice([1, 3], rng.integers(0, 2))]] = 0.0  # with A2 and A4 at once A1 is open too
        frame = kuka.to_frame(arm, q)
        for seed in (None, q):
            found = kuka.from_frame(arm, frame, seed=seed)
            assert arm.within_limits(found, tol=1e-9)
            assert np.allclose(arm.forward(found, undefined="nan")[0], frame.pose, rtol=0, atol=1e-8)
            differ = int(kuka.turn(arm, found)) ^ frame.turn
            assert kuka.status(arm, found) == frame.status
            assert not any(differ >> j & 1 for j in range(7) if j in (4, 6) or abs(q[j]) > 1e-9)
        assert np.allclose(found, q, rtol=0, atol=1e-6)  # the seed says how A5 and A7 share their turn
    # 0.05 rad between them, or a turn less: A5 and A7 cannot both be negative
    frame = kuka.to_frame(arm, [0.1, 0.4, 0.2, -1.2, -0.5, 0.0, 0.55])
    with pytest.raises(
        aa.ConfigurationError, match=r"turn is 88, but A6 is 0, where A5 and A7 turn one axis"
    ):
        kuka.from_frame(arm, frame._replace(turn=88))


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "kuka_med14_r820"])
def test_e1_arcs_are_where_the_posture_keeps_its_limits(name: str) -> None:
    arm = aa.Arm.from_catalogue(name)
    rng = draw.generator(17, 2)
    q = joints_of(arm, rng, draw.count(80))
    pose, status = arm.forward(q, undefined="nan")[0], kuka.status(arm, q)
    arcs = kuka.e1_arcs(arm, pose, status)
    assert arcs.contains(kuka.to_e1(arm, q)).all()
    for k in range(len(q)):
        e1 = rng.uniform(-np.pi, np.pi, 60)
        ends = arcs[k].intervals.ravel()
        if len(ends) and not arcs[k].is_full:
            e1 = np.concatenate(
                [e1, rng.choice(ends, 20) + rng.choice([-1, 1], 20) * 10.0 ** rng.uniform(-5, -1, 20)]
            )
        found = kuka.from_e1(arm, pose[k], e1, status[k], unreachable="nan")
        solved = ~np.isnan(found).any(axis=-1)
        holds = np.zeros(len(e1), bool)
        holds[solved] = arm.within_limits(found[solved], tol=1e-9)
        differ = holds != arcs[k].contains(e1)
        away = np.abs((e1[differ, None] - ends + np.pi) % (2 * np.pi) - np.pi)
        assert (away.min(axis=-1) < 1e-6).all() if differ.any() and len(ends) else not differ.any()


def test_batches_broadcast_and_none_is_found_is_said() -> None:
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    pose = arm.forward(q)[0]
    e1 = np.linspace(-3, 3, 25)
    many = kuka.from_e1(arm, pose, e1[:, None], np.arange(8), unreachable="nan")
    assert many.shape == (25, 8, 7)
    known = ~np.isnan(many[..., 0])
    assert known.any() and np.allclose(many[..., 2][known], np.broadcast_to(e1[:, None], known.shape)[known])
    assert np.allclose(arm.forward(many[known])[0], pose, rtol=0, atol=1e-12)
    with pytest.raises(aa.UnreachableError, match="out of reach"):
        kuka.from_e1(arm, aa.pose([9.0, 0, 0]), 0.0, 0)
    above = arm.forward([0.0, -0.8, 0.0, -1.8, 0.0, 0.5, 0.0])[0]
    with pytest.raises(aa.NoSolutionError, match=r"no posture of status 2 has A3 at E1 = 90.0000 deg"):
        kuka.from_e1(arm, above, np.pi / 2, 2)
    with pytest.raises(aa.InputError, match="elbow offsets"):
        kuka.status(aa.Arm.from_catalogue("barrett_wam7"), q)


@pytest.mark.parametrize(("call", "said"), [
    (lambda arm, p: kuka.from_e1(arm, p, np.nan, 0), "e1"),
    (lambda arm, p: kuka.from_e1(arm, p, 0.0, 8), "status is 8"),
    (lambda arm, p: kuka.from_e1(arm, p, 0.0, 1.5), "status is 1.5"),
    (lambda arm, p: kuka.from_e1(arm, p[:3], 0.0, 0), "pose"),
    (lambda arm, p: kuka.from_e1(arm, p, 0.0, 0, seed=[0.0]), "seed"),
    (lambda arm, p: kuka.from_e1(arm, p, 0.0, 0, unreachable="x"), "unreachable"),
    (lambda arm, p: kuka.e1_arcs(arm, p, "x"), "status"),
    (lambda arm, p: kuka.from_frame(arm, 3), "frame"),
    (lambda arm, p: kuka.from_frame(arm, kuka.KukaFrame(p, 0.1, 0, 128)), "turn is 128"),
    (lambda arm, p: kuka.turn(arm, [0.0]), "q"),
    (lambda arm, p: kuka.to_frame(arm, [[0.0] * 7]), "q"),
    (lambda arm, p: kuka.to_e1(arm, [np.inf] * 7), "q"),
    (lambda arm, p: kuka.pose([0, 0, 0], [np.nan, 0, 0]), "abc"),
    (lambda arm, p: kuka.status("arm", [0.0] * 7), "arm"),
])  # fmt: skip
def test_bad_input(call: Callable[[aa.Arm, np.ndarray], object], said: str) -> None:
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    with pytest.raises(aa.ArmangleError, match=said):
        call(arm, arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0])
