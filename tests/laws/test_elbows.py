"""Every law for elbows of every kind: links that are offset alone, d_se = 0 or d_ew = 0, and gaps d_4."""

from __future__ import annotations

import numpy as np
import pytest
from support.laws import classify
from support.strategies import Array, frame, postures, unlimited

import armangle as aa

LINKS = {
    # d_se, d_ew, a_3, a_4, d_4 in m
    "forearm": (0.28, 0.0, 0.0, -0.28, 0.0),
    "forearm, longer": (0.3, 0.0, 0.02, 0.41, 0.0),
    "upper arm": (0.0, 0.35, 0.3, 0.0, 0.0),
    "upper arm, offset forearm": (0.0, 0.35, -0.25, 0.04, 0.0),
    "both": (0.0, 0.0, 0.3, -0.25, 0.0),
    "both, one way": (0.0, 0.0, -0.2, -0.33, 0.0),
    "hardly a length": (1e-7, 0.4, 0.3, 0.0, 0.0),
    "gap": (0.41, 0.31, 0.0, 0.0, 0.0114),
    "gap, links of one length": (0.4, 0.4, 0.0, 0.0, -0.02),
    "wide gap": (0.3, 0.4, 0.0, 0.0, 0.25),
    "gap and offsets": (0.3, 0.35, 0.045, -0.06, -0.1),
    "gap and slant": (0.3, 0.0, 0.0, 0.3, 0.05),
    "hardly a gap": (0.4, 0.39, 0.0, 0.0, 1e-9),
}
REGIMES = ("uniform", "near_singular", "singular", "on_limit", "at_reach", "folded")


def slanted(name: str, seed: int = 0) -> aa.Arm:
    """An arm of `LINKS` with random signs, zeros, limits and frames."""
    d_se, d_ew, a_3, a_4, d_4 = LINKS[name]
    rng = np.random.default_rng([seed, list(LINKS).index(name)])
    plain = aa.Arm(d_bs=0.2, d_se=d_se, d_ew=d_ew, d_wf=0.1, a_3=a_3, a_4=a_4, d_4=d_4)
    signs, offsets = rng.choice([-1, 1], 7), rng.choice([0.0, np.pi / 2, -np.pi / 2, 0.3], 7)
    middle, half = rng.uniform(-1, 1, 7), rng.uniform(1.0, 3.5, 7)
    middle[3] = signs[3] * (plain.delta - offsets[3])
    return plain.with_(
        signs=signs, offsets=offsets, lower=middle - half, upper=middle + half,
        base=frame(rng), tool=frame(rng), name=name,
    )  # fmt: skip


def angle_between(one: Array, other: Array) -> Array:
    """Distance of angles on the circle, rad."""
    return np.abs(np.angle(np.exp(1j * (one - other))))


@pytest.mark.parametrize("name", LINKS)
def test_the_links_are_as_long_as_their_slant(name: str) -> None:
    arm = slanted(name)
    d_se, d_ew, a_3, a_4, d_4 = LINKS[name]
    upper, fore = np.hypot(d_se, a_3), np.hypot(d_ew, a_4)
    assert arm.reach == pytest.approx(np.hypot(upper + fore, d_4), abs=1e-15)
    assert arm.inner_reach == pytest.approx(np.hypot(upper - fore, d_4), abs=1e-15)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (500, 7))
    frames = unlimited(arm).frames(q)
    wrist, shoulder = frames[..., 5, :3, 3], frames[..., 1, :3, 3]
    far = np.linalg.norm(wrist - shoulder, axis=-1)
    assert arm.inner_reach - 1e-12 <= far.min() and far.max() <= arm.reach + 1e-12
    stretched = q.copy()
    stretched[:, 3] = arm.signs[3] * (arm.delta - arm.offsets[3])
    frames = unlimited(arm).frames(stretched)
    far = np.linalg.norm(frames[..., 5, :3, 3] - frames[..., 1, :3, 3], axis=-1)
    np.testing.assert_allclose(far, arm.reach, atol=1e-12)


@pytest.mark.parametrize("regime", REGIMES)
@pytest.mark.parametrize("name", LINKS)
def test_forward_and_inverse_are_each_others(name: str, regime: str) -> None:
    arm = unlimited(slanted(name))
    q = postures(slanted(name), regime, 400)
    pose, psi, gc = arm.forward(q)
    back = arm.inverse(pose, psi, gc, seed=q, limits=False)
    again, psi_again, gc_again = arm.forward(back, on_error="nan")
    np.testing.assert_allclose(again, pose, atol=1e-12)
    if regime == "uniform":
        np.testing.assert_allclose(back, q, atol=1e-9)
        assert (gc_again == gc).all() and angle_between(psi_again, psi).max() < 1e-9


@pytest.mark.parametrize("name", LINKS)
def test_self_motion_keeps_the_pose_and_is_the_derivative(name: str) -> None:
    arm = unlimited(slanted(name))
    pose, psi, gc = arm.forward(postures(slanted(name), "uniform", 300))
    turned = psi + np.random.default_rng(3).uniform(-np.pi, np.pi, len(psi))
    q = arm.inverse(pose, turned, gc, limits=False)
    np.testing.assert_allclose(arm.forward(q)[0], pose, atol=1e-12)
    rate = arm.self_motion(pose, turned, gc)
    clear = np.abs(rate).max(axis=-1) < 30
    step = 1e-6
    ahead, behind = (arm.inverse(pose, turned + by, gc, seed=q, limits=False) for by in (step, -step))
    np.testing.assert_allclose((ahead - behind)[clear] / (2 * step), rate[clear], atol=1e-3)
    twist = np.einsum("nij,nj->ni", arm.jacobian(q), rate)
    assert np.abs(twist[clear]).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", LINKS)
def test_feasible_is_within_limits(name: str, seed: int) -> None:
    arm = slanted(name, seed)
    q = np.vstack([postures(arm, regime, 12, seed) for regime in REGIMES])
    pose, psi, gc = unlimited(arm).forward(q)
    psi = np.random.default_rng(seed).uniform(-np.pi, np.pi, (len(q), 250))
    found = classify(arm, pose, gc, psi)
    assert found.wrong == []
    assert found.samples == psi.size and found.clear > 0.2 * found.samples


@pytest.mark.parametrize("name", LINKS)
def test_batches_intervals_and_paths_agree_with_one_pose(name: str) -> None:
    arm = slanted(name)
    q = postures(arm, "uniform", 64)
    pose, psi, gc = unlimited(arm).forward(q)
    one = np.array(
        [unlimited(arm).inverse(p, a, int(g), limits=False) for p, a, g in zip(pose, psi, gc, strict=True)]
    )
    np.testing.assert_allclose(unlimited(arm).inverse(pose, psi, gc, limits=False), one, atol=1e-12)
    for joint in (1, 2, 3, 5, 6, 7):
        values = aa.gradients.joint_function(arm, pose[0], int(gc[0]), joint).value(np.linspace(-3, 3, 50))
        solved = unlimited(arm).inverse(pose[0], np.linspace(-3, 3, 50), int(gc[0]), limits=False)[
            :, joint - 1
        ]
        assert angle_between(values, solved).max() < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in LINKS if LINKS[name][4]])
def test_plans_over_a_gap_are_certified_and_true(name: str) -> None:
    arm = slanted(name).with_(lower=None, upper=None)
    arm = arm.with_(lower=[-2.9] * 7, upper=[2.9] * 7)
    rng = np.random.default_rng(5)
    done = 0
    for q in rng.uniform(-1.5, 1.5, (12, 7)):
        pose = arm.forward(q)[0]
        end = pose.copy()
        end[:3, 3] += rng.normal(scale=0.03, size=3)
        path = aa.plan(arm, aa.Line(pose, end), start=q)
        if not path.ok:
            continue
        done += 1
        assert path.certified
        np.testing.assert_allclose(arm.forward(path.q)[0], path.poses, atol=1e-9)
        assert arm.within_limits(path.q).all()
    assert done >= 6


@pytest.mark.parametrize(("links", "what"), [({"d_ew": 0.0}, "forearm"), ({"d_se": 9e-7}, "upper arm"),
                                             ({"d_se": 5e-7, "a_3": 5e-7}, "upper arm")])  # fmt: skip
def test_a_link_of_no_length_is_refused(links: dict[str, float], what: str) -> None:
    plain = {"d_bs": 0.3, "d_se": 0.4, "d_ew": 0.4, "d_wf": 0.1}
    with pytest.raises(aa.InputError, match=f"the {what} is .* m long, wanted at least 1e-06"):
        aa.Arm(**(plain | links))


def test_a_path_can_be_planned() -> None:
    arm = aa.Arm.from_catalogue("pollen_reachy2_left")
    q = np.radians([-20, 40, 20, -80, 10, -10, 30.0])
    pose = arm.forward(q)[0]
    end = pose.copy()
    end[:3, 3] += [0.03, 0.02, 0.05]
    path = aa.plan(arm, aa.Line(pose, end), start=q)
    assert path.ok and path.certified
    np.testing.assert_allclose(arm.forward(path.q)[0], path.poses, atol=1e-9)
