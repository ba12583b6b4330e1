"""Laws of arms that are only nearly S-R-S: the true chain is met, not the nominal arm beside it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.calibrated import (
    ARMS,
    CALIBRATIONS,
    NAMES,
    Array,
    calibrated,
    off,
    off_singular,
    own_links,
    postures,
)
from support.draw import count, generator
from support.families import within
from support.laws import POSE, circle_gap, gap

import armangle as aa
from armangle.models.catalogue import srs_catalogue
from armangle.models.chain import chain_of
from armangle.models.detect import describe_chain

EVERY = pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS.keys())


@pytest.mark.turns(3)
@EVERY
def test_the_proven_share_is_that_of_other_poses_too(arm: aa.Arm) -> None:
    """`deviation.proven_share`, from 50 poses, is that of 400 others but for chance."""
    left_out = arm.feasible(arm.forward(postures(arm, 400, 43))[0]).unproven
    share = float(np.mean(~left_out.any(axis=-1)))
    by_chance = np.sqrt(share * (1.0 - share) * (1 / 50 + 1 / 400))
    assert abs(arm.deviation.proven_share - share) <= 4.0 * by_chance + 1 / 50
    assert arm.deviation.nominal.deviation.proven_share == 1.0


MEETINGS = {"yaskawa_sia5d": 1, "kuka_iiwa7_r800": 5, "iit_icub_left": 1, "franka_fr3": 4, "fetch": 2}
"""A joint (0 to 6) at whose zero, or quarter turn of an arm with an offset, two branches meet."""


@pytest.mark.parametrize("name", MEETINGS)
def test_a_seed_that_is_a_posture_is_given_back_beside_branches_that_meet_too(name: str) -> None:
    """`inverse` with a seed that holds pose, psi and gc returns it (to 1e-6 rad), near singularities, with a
    straight elbow and where two branches meet too.
    """
    arm = calibrated(name, 1.0, 1.0, seed=5)
    q, own, joint = within(arm, generator(23), count(4000)), arm.geometry, MEETINGS[name]
    q[::4, 3] = own.signs[3] * (own.delta - own.offsets[3])
    meet = 0.5 * np.pi if arm.redundancy != "arm_angle" else 0.0
    q[1::4, joint] = own.signs[joint] * (meet - own.offsets[joint])
    pose, psi, gc = arm.forward(q)
    back = arm.inverse(pose, psi, gc, seed=q, limits=False)
    assert np.abs(back - q).max() < 1e-6
    one = arm.inverse(pose[0], psi[0], gc[0], seed=q[0], limits=False)
    assert np.array_equal(one, back[0])


def test_a_branch_without_a_certain_posture_is_nan_beside_the_others() -> None:
    """`inverse` without gc gives NaN for a branch in doubt; with that gc it raises, and says why."""
    arm = calibrated("kuka_iiwa7_r800", 2.0, 5.0)
    pose, psi, _ = arm.forward([0.1, 0.4, 0.2, -0.01, 0.3, 0.8, 0.5])  # nearly stretched
    rows = arm.inverse(pose, psi, on_error="nan", limits=False)
    lost = int(np.flatnonzero(np.isnan(rows[:, 0]))[0])
    assert np.isfinite(rows).any()
    assert np.array_equal(arm.inverse(pose, psi, limits=False), rows, equal_nan=True)
    with pytest.raises(aa.NoSolutionError, match=r'^pose: Branches meet .* on_error="nan" gives NaN'):
        arm.inverse(pose, psi, lost, limits=False)
    far = np.stack([pose, pose])
    far[1, :3, 3] += 3.0
    with pytest.raises(aa.UnreachableError, match=r"^pose\[1\] is out of reach"):
        arm.deviation.nominal.inverse(far, psi, limits=False)


@pytest.mark.parametrize("name", NAMES)
def test_without_deviation_it_is_the_exact_arm(name: str) -> None:
    """With a chain that deviates by nothing all functions equal those of the plain arm."""
    arm = aa.Arm.from_catalogue(name)
    near = arm.with_(chain=own_links(arm))
    q = postures(arm, 300, 4)
    q = q[off_singular(arm, q, 0.05)]
    exact, kept = arm.forward(q), near.forward(q)
    assert gap(exact[0], kept[0]) <= 1e-12 and (exact[2] == kept[2]).all()
    assert circle_gap(exact[1], kept[1]).max() <= 1e-12
    pose, psi, gc = exact
    assert gap(arm.inverse(pose, psi, gc, limits=False), near.inverse(pose, psi, gc, limits=False)) <= 1e-12
    assert gap(arm.frames(q), near.frames(q)) <= 1e-12
    assert gap(arm.jacobian(q), near.jacobian(q)) <= 1e-12
    assert gap(arm.self_motion(pose, psi, gc), near.self_motion(pose, psi, gc)) <= 1e-9
    assert near.deviation.position_max <= 1e-12 and near.deviation.bands == (0.0, 0.0, 0.0)
    assert arm.deviation.position_max == 0.0 and arm.deviation.bands == (0.0, 0.0, 0.0)
    assert arm.deviation.nominal is arm
    pose, _, gc = arm.forward(postures(arm, 30, 26))
    ours, true = near.feasible(pose, gc), arm.feasible(pose, gc)
    apart = (true & ~ours).measure + (ours & ~true).measure
    proven = ours.unproven == 0.0
    assert proven.sum() >= 25 and (apart <= 1e-9 * (1 + true.count))[proven].all()


def test_without_deviation_the_nearest_are_those_of_the_exact_arm() -> None:
    """With a chain that deviates by nothing `solve` equals that of the plain arm."""
    exact = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    near = exact.with_(chain=own_links(exact))
    q = postures(exact, count(20), 32)
    seeds, pose = q + generator(33).normal(0, 0.3, q.shape), exact.forward(q)[0]
    for asked in ({"metric": "l2"}, {"metric": "max"}, {"prefer": "margin"}):
        a, b = (arm.solve(pose, seeds, **asked) for arm in (exact, near))
        if "prefer" in asked:
            assert gap(a.margin, b.margin) <= 1e-9
        else:
            assert gap(a.distance, b.distance) <= 1e-9
            assert (a.gc == b.gc).all() and (a.status == b.status).all()


def test_where_branches_meet_the_inverse_is_exact_or_says_why_not() -> None:
    """`inverse` where branches meet raises and says so; else it is exact."""
    arm = ARMS["kuka_iiwa7_r800 1.0 mm"]
    q = postures(arm, 4000, 7)
    q[:, 5] = 1e-4 * generator(8).uniform(-1, 1, 4000)
    pose, psi, gc = arm.forward(q)
    again = arm.inverse(pose, psi, gc, on_error="nan", limits=False)
    lost = ~np.isfinite(again[:, 0])
    assert lost.sum() > 0
    assert gap(arm.forward(again[~lost])[0], pose[~lost]) <= POSE
    with pytest.raises(aa.NoSolutionError, match="Branches meet here"):
        arm.inverse(pose[lost][0], psi[lost][0], gc[lost][0], limits=False)
    assert arm.deviation.bands[2] > 0.0


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ["openarm_v10", "human_arm_left", "rokae_ar5_left", "agilex_nero"])
def test_noise_does_not_choose_the_senses_of_axes(name: str) -> None:
    """`describe_chain` finds the same signs, zeros and base in spite of 0.3 mm and mrad of noise."""
    exact = chain_of(aa.Arm.from_catalogue(name)._description())
    wanted, rng = describe_chain(exact, exact=False)[0], generator(len(name))

    def noisy(origin: Array) -> Array:
        """A frame moved by noise."""
        return origin @ aa.pose(0.3e-3 * rng.normal(size=3), rotvec=0.3e-3 * rng.normal(size=3))

    for _ in range(3):
        joints = tuple(replace(joint, origin=noisy(joint.origin)) for joint in exact.joints)
        chain = replace(exact, joints=joints, tip_origin=noisy(exact.tip_origin))
        found = describe_chain(chain, exact=False)[0]
        assert found.chain is not None and found.signs == wanted.signs
        off = np.array(found.offsets) - np.array(wanted.offsets)
        assert np.abs((off + np.pi) % (2 * np.pi) - np.pi).max() < 0.02
        assert np.abs(found.base[:3, :3] - wanted.base[:3, :3]).max() < 0.02


def test_a_file_that_is_nearly_srs_keeps_its_chain() -> None:
    """`from_urdf` of a nearly S-R-S arm keeps the chain and reports its deviation; fit="srs" raises."""
    made = calibrated("kuka_iiwa7_r800", 1.0, 1.0)
    with pytest.raises(aa.ModelError, match="not S-R-S, but near it"):
        aa.Arm.from_urdf(made.to_urdf(), fit="srs", angle_tolerance=1e-5, length_tolerance=2e-5)
    read = aa.Arm.from_urdf(made.to_urdf())
    q = postures(made, 50, 9)
    assert gap(read.forward(q)[0], made.forward(q)[0]) <= POSE
    assert read.deviation.position_rms < made.deviation.position_rms  # fitted, where the other was not
    assert "only nearly S-R-S" in str(read.report)
    assert 0.0 < read.deviation.position_rms <= read.deviation.position_max < 0.01
    assert "mrad rms" in str(read.deviation)
    exact = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    assert aa.Arm.from_urdf(exact.to_urdf()).geometry.chain is None


@pytest.mark.parametrize(
    "change", [{"d_se": 0.5}, {"a_3": 0.01}, {"signs": [-1] * 7}, {"offsets": [0.1] * 7}]
)
def test_the_nominal_arm_is_not_changed_behind_its_chain(change: dict[str, Any]) -> None:
    """`with_` of lengths, signs or zeros of a calibrated arm raises unless chain=None is given."""
    arm = ARMS["kuka_iiwa7_r800 1.0 mm"]
    with pytest.raises(aa.InputError, match=f"with_\\({next(iter(change))}=.*arm.deviation.nominal"):
        arm.with_(**change)
    assert arm.deviation.nominal.with_(**change).geometry.chain is None
    assert arm.with_(**change, chain=None).geometry.chain is None


def test_a_chain_alone_says_what_it_needs() -> None:
    """`Arm(chain=)` without lengths raises, and names them."""
    with pytest.raises(aa.InputError, match="d_bs, d_se, d_ew, d_wf are not given"):
        aa.Arm(chain=ARMS["kuka_iiwa7_r800 1.0 mm"].geometry.chain)


PLAIN = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
TWIST = np.pi / 2 * np.array([-1, 1, 1, -1, -1, 1, 0])
TABLE = np.column_stack([np.zeros(7), TWIST, [0.34, 0, 0.4, 0, 0.4, 0, 0.126], np.zeros(7)])
"""Its rows of DH parameters: a, alpha, d, theta."""


def test_a_dh_table_is_a_chain() -> None:
    """`dh_chain` of the arm's own table, in both conventions, gives the same poses, with tool and
    base too.
    """
    q = generator(11).uniform(-2, 2, (10, 7))
    same = PLAIN.with_(chain=aa.dh_chain(TABLE))
    assert gap(same.forward(q)[0], PLAIN.forward(q)[0]) <= POSE
    tool, base = aa.pose([0.1, 0.2, 0.3], rpy=[0.1, 0, 0]), aa.pose([0, 0, 1.0])
    ended = PLAIN.with_(tool=tool, base=base, chain=aa.dh_chain(TABLE, tool=tool, base=base))
    assert gap(ended.forward(q)[0], base @ PLAIN.forward(q)[0] @ tool) <= POSE
    # Craig's order: alpha and a belong to the link before
    craig = np.column_stack([np.zeros(7), np.roll(TWIST, 1), TABLE[:, 2], np.zeros(7)])
    assert gap(aa.dh_chain(craig, modified=True)[0], np.eye(4)) == 0.0
    assert (
        gap(PLAIN.with_(chain=aa.dh_chain(craig, modified=True)).forward(q)[0], PLAIN.forward(q)[0]) <= POSE
    )
    turned = TABLE.copy()
    turned[1, 3] = 0.01
    shifted = q.copy()
    shifted[:, 1] += 0.01
    assert gap(PLAIN.with_(chain=aa.dh_chain(turned)).forward(q)[0], PLAIN.forward(shifted)[0]) <= POSE


def test_a_table_in_other_units_or_order_is_asked_about() -> None:
    """`dh_chain` refuses degrees, mm and the other convention, and says so."""
    for column, factor, said in (
        (1, 180 / np.pi, r"rows\[0\] has alpha -90; angles are in rad: were these degrees\?"),
        (2, 1e3, r"rows\[2\] has d 400; lengths are in m: was this in mm\?"),
    ):
        other = TABLE.copy()
        other[:, column] *= factor
        with pytest.raises(aa.InputError, match=said):
            aa.dh_chain(other)
    with pytest.raises(aa.InputError, match="is it of dh_chain's other order, modified=True or False"):
        PLAIN.with_(chain=aa.dh_chain(TABLE, modified=True))


@pytest.mark.parametrize("end", ["tool", "base"])
@pytest.mark.parametrize("length", [0.004, 0.1, 0.8])
def test_a_chain_that_leaves_out_the_tool_or_base_is_refused(end: str, length: float) -> None:
    """`with_(chain=)` without the arm's own tool or base raises; with it, the poses are right."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    bare = off(own_links(arm), 0.3, 0.5, generator(17))
    given = arm.with_(**{end: aa.pose([0.0, 0.0, length], rpy=[0.0, 0.0, 0.3])})
    with pytest.raises(aa.InputError, match=rf"leaves out its {end}=: .* dh_chain\(..., {end}=arm.{end}\)"):
        given.with_(chain=bare)
    whole = bare.copy()
    if end == "tool":
        whole[-1] = whole[-1] @ given.tool
    else:
        whole[0] = given.base @ whole[0]
    kept = given.with_(chain=whole)
    q = postures(arm, 5, 18)
    mounted = arm.with_(chain=bare).with_(**{end: getattr(given, end)})
    assert gap(kept.forward(q)[0], mounted.forward(q)[0]) <= POSE


def test_a_chain_with_the_tool_and_base_of_its_arm_is_taken() -> None:
    """`with_(chain=)` takes calibrated chains of every S-R-S arm."""
    for name in srs_catalogue():
        made = aa.Arm.from_catalogue(name)
        for mm, mrad in CALIBRATIONS:
            links = off(own_links(made), mm, mrad, generator(19))
            assert made.with_(chain=links).geometry.chain is not None


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", ARMS)
def test_the_elbow_comes_as_near_to_a_point_as_the_deviation_leaves(name: str) -> None:
    """`psi_towards` of a calibrated arm brings the elbow as near to a point as any psi, but for the
    deviation.
    """
    arm = ARMS[name]
    free = arm.with_(lower=-np.inf, upper=np.inf)
    circle, asked = np.linspace(-np.pi, np.pi, 721), 0
    for q in postures(arm, 20, 31):
        pose, _, gc = free.forward(q, on_error="nan")
        rows = free.inverse(pose, circle, gc, on_error="nan", limits=False)
        rows = rows[np.isfinite(rows[:, 0])]
        point = np.array([0.3, 0.2, 1.0])
        psi = free.psi_towards(pose, gc, point, on_error="nan")
        if np.isnan(psi) or not len(rows):  # stretched, or beyond the nominal arm's reach
            continue
        q = free.inverse(pose, psi, gc, on_error="nan", limits=False)
        if np.isnan(q[0]):  # in a band where branches merge
            continue
        slack = 2.0 * arm.deviation.position_max + 1e-4
        least = np.linalg.norm(free.elbow(rows) - point, axis=1).min()
        assert np.linalg.norm(free.elbow(q) - point) <= least + slack
        asked += 1
    assert asked > 10
