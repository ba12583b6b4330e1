"""Every law for elbows of every kind: links that are offset alone, d_se = 0 or d_ew = 0, and gaps d_4."""

from __future__ import annotations

import numpy as np
import pytest
from support.laws import classify
from support.strategies import LINKS, REGIMES, postures, slanted, unlimited

import armangle as aa


@pytest.mark.parametrize("name", LINKS)
def test_the_links_are_as_long_as_their_slant(name: str) -> None:
    """`geometry.reach` and `inner_reach` are the extreme distances between shoulder and wrist for every
    elbow.
    """
    arm = slanted(name)
    d_se, d_ew, a_3, a_4, d_4 = LINKS[name]
    upper, fore = np.hypot(d_se, a_3), np.hypot(d_ew, a_4)
    assert arm.geometry.reach == pytest.approx(np.hypot(upper + fore, d_4), abs=1e-15)
    assert arm.geometry.inner_reach == pytest.approx(np.hypot(upper - fore, d_4), abs=1e-15)
    q = np.random.default_rng(1).uniform(-np.pi, np.pi, (500, 7))
    frames = unlimited(arm).frames(q)
    wrist, shoulder = frames[..., 5, :3, 3], frames[..., 1, :3, 3]
    far = np.linalg.norm(wrist - shoulder, axis=-1)
    assert arm.geometry.inner_reach - 1e-12 <= far.min() and far.max() <= arm.geometry.reach + 1e-12
    stretched = q.copy()
    stretched[:, 3] = arm.geometry.signs[3] * (arm.geometry.delta - arm.geometry.offsets[3])
    frames = unlimited(arm).frames(stretched)
    far = np.linalg.norm(frames[..., 5, :3, 3] - frames[..., 1, :3, 3], axis=-1)
    np.testing.assert_allclose(far, arm.geometry.reach, atol=1e-12)


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", LINKS)
def test_feasible_is_within_limits(name: str, seed: int) -> None:
    """`feasible` of arms with every kind of elbow agrees with limits in all samples."""
    arm = slanted(name, seed)
    q = np.vstack([postures(arm, regime, 12, seed) for regime in REGIMES])
    pose, psi, gc = unlimited(arm).forward(q)
    psi = np.random.default_rng(seed).uniform(-np.pi, np.pi, (len(q), 250))
    found = classify(arm, pose, gc, psi)
    assert found.wrong == []
    assert found.samples == psi.size and found.clear > 0.2 * found.samples


@pytest.mark.turns(6)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["forearm", *(name for name in LINKS if LINKS[name][4])])
def test_plans_over_a_gap_or_a_slant_are_certified_and_true(name: str) -> None:
    """Plans of arms with a gap or slant at the elbow, if ok, are certified, on their poses and in limits."""
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
