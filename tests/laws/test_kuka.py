"""E1, Status and Turn of KUKA's controllers: there and back, arcs, and a frame taught on a robot."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from support import draw
from support.refused import not_refused

import armangle as aa
from armangle import kuka
from armangle.models.catalogue import srs_catalogue

KUKAS = [name for name in srs_catalogue() if name.startswith("kuka_")]
# A frame taught on an iiwa 7 with a media flange (wrist to flange 0.152 m), of the public project
# WerthersEchte/LegoArmCode: mm, rad, and the joints that the same project shows for it, degrees.
TAUGHT_XYZ = np.array([452.42385876038577, 348.36217544715095, 283.1412480812374]) / 1e3
TAUGHT_ABC = [-1.5508203797342421, 0.012741977250006269, 3.1400739722045863]
TAUGHT_E1, TAUGHT_STATUS, TAUGHT_TURN = -0.10968969306569962, 2, 76
TAUGHT_Q = [41.83, 36.92, -6.28, -87.49, 5.36, 55.51, -57.36]
# X Y Z mm, A B C rad, E1 rad, Status, Turn, of frames taught with the flange (an iiwa 7 of the public project
# UM-ARM-Lab/kuka_iiwa_interface, an iiwa 14 of Aleynikovich/iiwaTOFAS) and with a tool (the latter). Three
# more of the former are out of reach of an iiwa: they were taught with another base.
VICTOR = np.array([
    (262.01210351949703, -228.83458471985912, 813.2998584623085, 0.9554774028242227, -0.4231889154717545,
     -0.7078765077356982, -0.8088058713717114, 3, 78),
    (260.01881083032896, -412.086915870889, 807.2033102914111, 1.1027506880587767, -0.6498052730734576,
     -0.5367872376038461, -0.8090688052235244, 3, 78),
    (231.86895091023584, -421.54741308389487, 835.1446101632788, 1.1028572445283342, -0.6495125973032967,
     -0.5365527195344839, -0.8090302759894559, 3, 78),
    (231.94519074492007, -272.92619003596155, 835.0666993879205, 1.1026059541881699, -0.649755454774086,
     -0.5360900707757048, -0.8092156119573097, 3, 78),
    (387.09296775750556, -233.4809711260942, 810.3345082127878, 1.874358757397437, 0.7508557878754416,
     2.242422608996685, -0.8711273762075902, 7, 110),
    (497.39737741254015, -346.54929380248376, 744.4926234400041, 1.8924281139478134, 0.824753483750736,
     2.3652633699330665, -0.8712261261730865, 7, 110),
    (224.72467818210313, -369.2503873491582, 690.1936612523939, 2.334509817611157, 0.0800986492973757,
     0.0494396122309387, -1.1363822554352978, 3, 78),
])  # fmt: skip
TOFAS_FLANGE = np.array([
    (219.21620361123038, -544.9301216072606, 589.4096877471184, 1.953262048971699, -0.004241876093880712,
     -3.141573025461631, -3.1818115845404374e-05, 2, 29),
    (62.093320704175696, -154.38154048188528, 968.2458152023592, 1.9532395371912485, 0.9271522489704367,
     3.1415717431486696, -3.2597078107185094e-05, 2, 31),
    (8.682466735309907, -21.622208131555848, 990.1536033006842, 1.9532123174764917, 1.1571830338762747,
     3.141541404907143, -3.277684702014051e-05, 3, 31),
])  # fmt: skip
TOFAS_TOOL = np.array([
    (144.00867806670425, -484.7624107276638, 784.7898556028013, 0.3660960466129827, 0.4454192298559966,
     1.1082673192386265, 0.8248135001454956, 6, 43),
    (169.95591088722173, -720.5123387749121, 741.9540830737191, 0.365866355457512, 0.4455986988323977,
     1.1080745496166355, 0.8247710161044249, 6, 41),
    (25.489145832297837, -771.3775342148537, 800.7793738896202, 0.36568136534446033, 0.44550319778449937,
     1.1081877832976386, 0.8247738922979493, 6, 41),
    (29.69918769939234, -525.7947282881462, 634.9434413714619, 0.35189765910399645, 0.47035046032668965,
     1.1020955085547286, 0.8248520893752571, 6, 43),
    (172.86506418323233, -751.9049055554739, 641.0057410724015, 0.36609081181813635, 0.4453303904499046,
     1.108397440626671, 0.824759511221245, 6, 41),
    (241.40817516495878, -856.6056711756299, 696.3893066714681, 0.366243383242635, 0.4455300530130324,
     1.1082740787478855, 0.8247755701047758, 6, 41),
    (197.11110167770678, -383.7717997138517, 585.0370484201621, 0.10155221454954336, -0.10991443831132687,
     0.9936580964716736, 0.8247888126813921, 6, 43),
])  # fmt: skip
TOFAS_TCP = [134.73358038802547, -154.2600792356306, -86.36828559938691, 0.0, 1.5707926535897934, 0.0]


def joints_of(arm: aa.Arm, rng: np.random.Generator, count: int) -> np.ndarray:
    """Random joints within the limits, some with A2, A3, or all but A2, A4 and A6 at 0."""
    q = rng.uniform(arm.lower, arm.upper, (count, 7))
    q[: count // 20, 1] = 0.0
    q[count // 20 : count // 10, 2] = 0.0
    q[count // 10 : count // 8, :] *= [0, 1, 0, 1, 0, 1, 0]
    return q


@pytest.mark.parametrize("name", KUKAS)
def test_pose_e1_and_status_give_the_joints_back(name: str) -> None:
    arm = aa.Arm.from_catalogue(name)
    q = joints_of(arm, draw.generator(17, 1), draw.count(2000))
    pose = arm.forward(q, on_error="nan")[0]
    back = kuka.from_e1(arm, pose, kuka.to_e1(arm, q), kuka.status(arm, q), seed=q)
    assert np.abs(back - q).max() < 1e-6  # beside A2 = A4 = 0 no better than the pose's own rounding
    calm = (np.abs(np.sin(q[:, [1, 3, 5]])) > 1e-2).all(axis=1)
    assert np.abs(back - q)[calm].max() < 1e-10
    signed = calm & (np.abs(q) > 1e-9).all(axis=1)
    assert np.array_equal(kuka.turn(arm, back)[signed], kuka.turn(arm, q)[signed])


def test_a_frame_taught_on_a_robot() -> None:
    """`from_frame` of a taught frame gives the robot's joints, `to_frame` the frame; a wrong Turn raises."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(d_wf=0.152)
    frame = kuka.KukaFrame(kuka.pose(TAUGHT_XYZ, TAUGHT_ABC), TAUGHT_E1, TAUGHT_STATUS, TAUGHT_TURN)
    q = kuka.from_frame(arm, frame)
    assert np.degrees(q).round(2).tolist() == TAUGHT_Q
    again = kuka.to_frame(arm, q)
    assert (again.status, again.turn) == (TAUGHT_STATUS, TAUGHT_TURN)
    assert np.allclose(again.pose, frame.pose, rtol=0, atol=1e-12)
    assert np.allclose(kuka.abc(frame.pose), TAUGHT_ABC, rtol=0, atol=1e-12)
    with pytest.raises(aa.InputError, match=r"turn is 77, but pose, E1 and Status give 76: A1 differ"):
        kuka.from_frame(arm, frame._replace(turn=77))


@pytest.mark.parametrize(("robot", "frames", "tcp"), [
    ("kuka_iiwa7_r800", VICTOR, [0.0] * 6),
    ("kuka_iiwa14_r820", TOFAS_FLANGE, [0.0] * 6),
    ("kuka_iiwa14_r820", TOFAS_TOOL, TOFAS_TCP),
])  # fmt: skip
def test_frames_of_public_projects_have_the_turn_that_was_taught(
    robot: str, frames: np.ndarray, tcp: list[float]
) -> None:
    """`from_frame` of taught frames is within limits and on the pose, and `to_frame` gives them back."""
    arm = aa.Arm.from_catalogue(robot).with_(d_wf=0.152)  # the media flange
    arm = arm.with_tool(kuka.pose(np.array(tcp[:3]) / 1e3, tcp[3:]))
    for row in frames:
        pose, e1, (wanted, turns) = kuka.pose(row[:3] / 1e3, row[3:6]), row[6], row[7:].astype(int)
        q = kuka.from_frame(arm, kuka.KukaFrame(pose, e1, int(wanted), int(turns)))
        assert arm.within_limits(q) and np.allclose(arm.forward(q)[0], pose, rtol=0, atol=1e-12)
        again = kuka.to_frame(arm, q)
        assert (again.status, again.turn) == (wanted, turns) and again.e1 == pytest.approx(e1, abs=1e-12)


@pytest.mark.parametrize("name", KUKAS)
def test_a_frame_of_a_singular_posture_is_read(name: str) -> None:
    """`from_frame` reads frames of singular joints, with the seed exactly; a Turn that contradicts raises."""
    arm, rng = aa.Arm.from_catalogue(name), draw.generator(17, 6)
    for number, q in enumerate(rng.uniform(arm.lower, arm.upper, (draw.count(120), 7))):
        wrist = number % 2 == 0
        straight = [1, 3, 5] if rng.integers(0, 2) else [1, 3]
        q[[5, *rng.choice([1, 3], rng.integers(0, 2))] if wrist else straight] = 0.0
        frame = kuka.to_frame(arm, q)
        for seed in (None, q):
            found = kuka.from_frame(arm, frame, seed=seed)
            assert arm.within_limits(found, tol=1e-9)
            assert np.allclose(arm.forward(found, on_error="nan")[0], frame.pose, rtol=0, atol=1e-8)
            assert kuka.status(arm, found) == frame.status or not wrist
            differ = int(kuka.turn(arm, found)) ^ frame.turn
            assert not any(differ >> j & 1 for j in range(7) if abs(q[j]) > 1e-9 or (wrist and j in (4, 6)))
        assert np.allclose(found, q, rtol=0, atol=1e-6)  # the seed says how the joints share their turn
    # 0.05 rad between them, or a turn less: A5 and A7 cannot both be negative
    for q, turn, said in (
        ([0.1, 0.4, 0.2, -1.2, -0.5, 0.0, 0.55], 88, "turn is 88, but A6 is 0, where A5 and A7"),
        ([-0.05, 0.0, 0.2, 0.0, -0.05, 0.8, 0.55], 0, "but A2 and A4 are 0, where A1 and A5"),
    ):
        with pytest.raises(aa.InputError, match=said):
            kuka.from_frame(arm, kuka.to_frame(arm, q)._replace(turn=turn))


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "kuka_med14_r820"])
def test_e1_arcs_are_where_the_posture_keeps_its_limits(name: str) -> None:
    """`e1_arcs` holds the E1 at which `from_e1` is within limits."""
    arm = aa.Arm.from_catalogue(name)
    rng = draw.generator(17, 2)
    q = joints_of(arm, rng, draw.count(80))
    pose, status = arm.forward(q, on_error="nan")[0], kuka.status(arm, q)
    arcs = kuka.e1_arcs(arm, pose, status)
    assert arcs.contains(kuka.to_e1(arm, q)).all()
    for k in range(len(q)):
        e1 = rng.uniform(-np.pi, np.pi, 60)
        ends = arcs[k].intervals.ravel()
        if len(ends) and not arcs[k].is_full:
            e1 = np.concatenate(
                [e1, rng.choice(ends, 20) + rng.choice([-1, 1], 20) * 10.0 ** rng.uniform(-5, -1, 20)]
            )
        found = kuka.from_e1(arm, pose[k], e1, status[k], on_error="nan")
        solved = ~np.isnan(found).any(axis=-1)
        holds = np.zeros(len(e1), bool)
        holds[solved] = arm.within_limits(found[solved], tol=1e-9)
        differ = holds != arcs[k].contains(e1)
        away = np.abs((e1[differ, None] - ends + np.pi) % (2 * np.pi) - np.pi)
        assert (away.min(axis=-1) < 1e-6).all() if differ.any() and len(ends) else not differ.any()


def test_batches_broadcast_and_none_is_found_is_said() -> None:
    """`from_e1` broadcasts, is NaN on request, and else raises and says why there is no solution."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    pose = arm.forward(q)[0]
    e1 = np.linspace(-3, 3, 25)
    many = kuka.from_e1(arm, pose, e1[:, None], np.arange(8), on_error="nan")
    assert many.shape == (25, 8, 7)
    known = ~np.isnan(many[..., 0])
    assert known.any() and np.allclose(many[..., 2][known], np.broadcast_to(e1[:, None], known.shape)[known])
    assert np.allclose(arm.forward(many[known])[0], pose, rtol=0, atol=1e-12)
    with pytest.raises(aa.UnreachableError, match="out of reach"):
        kuka.from_e1(arm, aa.pose([9.0, 0, 0]), 0.0, 0)
    above = arm.forward([0.0, -0.8, 0.0, -1.8, 0.0, 0.5, 0.0])[0]
    with pytest.raises(aa.NoSolutionError, match=r"no solution of status 2 has A3 at E1 = 90.0000 deg"):
        kuka.from_e1(arm, above, np.pi / 2, 2)
    with pytest.raises(aa.InputError, match="elbow offsets"):
        kuka.status(aa.Arm.from_catalogue("barrett_wam7"), q)


def test_bad_input() -> None:
    """Functions of `kuka` refuse bad arguments, and say which."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    p = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])[0]
    rows: list[tuple[str, Callable[[], object]]] = [
        ("e1", lambda: kuka.from_e1(arm, p, np.nan, 0)),
        ("status is 8", lambda: kuka.from_e1(arm, p, 0.0, 8)),
        ("status is 1.5", lambda: kuka.from_e1(arm, p, 0.0, 1.5)),
        ("pose", lambda: kuka.from_e1(arm, p[:3], 0.0, 0)),
        ("seed", lambda: kuka.from_e1(arm, p, 0.0, 0, seed=[0.0])),
        ("status", lambda: kuka.e1_arcs(arm, p, "x")),
        ("on_error", lambda: kuka.from_e1(arm, p, 0.0, 0, on_error="x")),
        ("frame", lambda: kuka.from_frame(arm, 3)),
        ("turn is 128", lambda: kuka.from_frame(arm, kuka.KukaFrame(p, 0.1, 0, 128))),
        ("q", lambda: kuka.turn(arm, [0.0])), ("q", lambda: kuka.to_frame(arm, [[0.0] * 7])),
        ("q", lambda: kuka.to_e1(arm, [np.inf] * 7)), ("abc", lambda: kuka.pose([0, 0, 0], [np.nan, 0, 0])),
        ("arm", lambda: kuka.status("arm", [0.0] * 7)),
    ]  # fmt: skip
    assert not_refused((aa.ArmangleError, said, call) for said, call in rows) == []
