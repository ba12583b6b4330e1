"""The functions of JAX: the numbers of Arm under jit, vmap and scan, derivatives against differences."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from support import draw
from support.gradients import FAMILIES, HOME, change, moved, postures
from support.needs import need
from support.refused import not_refused

import armangle as aa

jax = need("jax")


@pytest.fixture(autouse=True)
def double() -> Iterator[None]:
    """Numbers in float64; each test leaves JAX as it was."""
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", FAMILIES)
def test_the_numbers_are_those_of_arm(name: str) -> None:
    """Functions of `jax.Kinematics` under jit equal those of Arm to the bit."""
    arm, q = postures(name, 200, 17, 31)
    kinematics = aa.jax.Kinematics(arm)
    pose, psi, gc = jax.jit(kinematics.forward)(q)
    for found, wanted in zip((pose, psi, gc), arm.forward(q), strict=True):
        assert np.array_equal(found, wanted)
    assert np.array_equal(
        jax.jit(kinematics.inverse)(pose, psi, gc), arm.inverse(*arm.forward(q), limits=False)
    )
    assert np.array_equal(kinematics.freedom(pose), arm.freedom(np.array(pose)).total)
    assert np.array_equal(kinematics.limit_margin(q), arm.limit_margin(q))
    if "chain" not in arm.kind:
        near = arm.with_(singularity_margin=0.1)
        drawn = aa.jax.Kinematics(near).freedom(pose)
        assert np.array_equal(drawn, near.freedom(np.array(pose)).total)


def test_float32_is_computed_in_float64() -> None:
    """In float32 `jax.Kinematics` rounds results that were computed in float64."""
    jax.config.update("jax_enable_x64", False)
    arm, q = postures("kuka_iiwa7_r800", 100, 17, 31)
    kinematics = aa.jax.Kinematics(arm)
    pose, psi, gc = kinematics.forward(q)
    assert pose.dtype == np.float32
    found = kinematics.inverse(pose, psi, gc)
    assert found.dtype == np.float32
    assert np.array_equal(
        found, arm.inverse(np.array(pose), np.array(psi), np.array(gc), limits=False).astype(np.float32)
    )


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", FAMILIES)
def test_derivatives_are_the_limit_of_differences(name: str) -> None:
    """jvp and grad of `forward` and `inverse` equal differences."""
    arm, q = postures(name, 30, 17, 31)
    kinematics, rng, step = aa.jax.Kinematics(arm), draw.generator(17, 32), 1e-6
    pose, psi, gc = arm.forward(q)
    twist = rng.normal(size=(len(q), 7))
    ahead, behind = (
        arm.inverse(
            moved(pose, way * step * twist[:, :6]), psi + way * step * twist[:, 6], gc, seed=q, limits=False
        )
        for way in (1, -1)
    )
    along_pose = change(pose, twist[:, :6])

    def inverse(frame: object, angle: object) -> object:
        """The joints, as a function of pose and psi."""
        return kinematics.inverse(frame, angle, gc)

    _, along = jax.jvp(inverse, (pose, psi), (along_pose, twist[:, 6]))
    difference = (ahead - behind) / (2 * step)
    assert np.allclose(along, difference, rtol=1e-5, atol=1e-5 * np.abs(difference).max())
    weight = rng.normal(size=(len(q), 7))
    by_pose, by_psi = jax.grad(lambda p, a: (weight * inverse(p, a)).sum(), argnums=(0, 1))(pose, psi)
    said = (np.array(by_pose) * along_pose).sum((-1, -2)) + np.array(by_psi) * twist[:, 6]
    assert np.allclose(said, (weight * np.array(along)).sum(-1), rtol=1e-7, atol=1e-7)
    ends = [arm.forward(q + way * step * weight)[:2] for way in (1, -1)]
    _, (dpose, dpsi, _) = jax.jvp(kinematics.forward, (q,), (weight,))
    assert np.allclose(dpose, (ends[0][0] - ends[1][0]) / (2 * step), rtol=1e-5, atol=1e-6)
    turned = (ends[0][1] - ends[1][1] + np.pi) % (2 * np.pi) - np.pi
    assert np.allclose(dpsi, turned / (2 * step), rtol=1e-5, atol=1e-5)


@pytest.mark.turns(3)
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "franka_fr3", "fetch", "calibrated kinova_movo"])
def test_derivatives_of_freedom_and_of_the_limit_margin_are_those_of_arm(name: str) -> None:
    """Derivatives of `freedom` and `limit_margin` equal those of `gradients`."""
    arm, q = postures(name, 40, 17, 31)
    kinematics, twist = aa.jax.Kinematics(arm), draw.generator(17, 33).normal(size=6)
    pose = arm.forward(q)[0]
    _, along = jax.jvp(kinematics.freedom, (pose,), (change(pose, twist),))
    assert np.allclose(along, aa.gradients.freedom(arm, pose) @ twist, rtol=1e-10, atol=1e-10, equal_nan=True)
    slope = jax.vmap(jax.grad(kinematics.limit_margin))(q)
    assert np.array_equal(slope, aa.gradients.limit_margin(arm, q))


@pytest.mark.turns(4)
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "franka_fr3", "fetch", "calibrated kinova_movo"])
@pytest.mark.parametrize("prefer", ["seed", "margin"])
def test_derivatives_go_through_solve(prefer: str, name: str) -> None:
    """`jax.Kinematics.solve` and its derivatives equal those of Arm and `gradients`, in float32 roughly."""
    arm, q = postures(name, 30, 17, 35)
    rng, pose = draw.generator(17, 36), arm.forward(q)[0]
    seed, twist, turn = q + rng.normal(size=q.shape), rng.normal(size=(len(q), 6)), rng.normal(size=q.shape)
    for near in (arm, arm.with_(singularity_margin=0.3)):
        kinematics = aa.jax.Kinematics(near)

        def answer(poses: object, seeds: object, kinematics: object = kinematics) -> object:
            """The joints of `solve`."""
            return kinematics.solve(poses, seeds, prefer=prefer)[0]

        wanted = near.solve(pose, seed, prefer=prefer)
        found, psi, gc, ok = jax.jit(lambda p, s, k=kinematics: k.solve(p, s, prefer=prefer))(pose, seed)
        for one, other in zip(
            (found, psi, gc, ok), (wanted.q, wanted.psi, wanted.gc, wanted.ok), strict=True
        ):
            assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f")
        slopes = aa.gradients.solve(near, pose, seed, prefer=prefer)
        _, along = jax.jvp(answer, (pose, seed), (change(pose, twist), turn))
        said = (slopes @ np.concatenate([twist, turn], axis=-1)[..., None])[..., 0]
        assert np.allclose(along, said, rtol=1e-9, atol=1e-9, equal_nan=True)
        known = np.isfinite(slopes).all(axis=(1, 2))
        by_seed = jax.grad(lambda s, f=answer, k=known: f(pose, s)[k].sum())(seed)
        assert np.allclose(by_seed[known], slopes[known].sum(-2)[:, 6:], rtol=1e-9, atol=1e-9)
    jax.config.update("jax_enable_x64", False)
    single = jax.vmap(jax.jacrev(lambda s, p: aa.jax.Kinematics(arm).solve(p, s)[0]))(seed, pose)
    assert single.dtype == np.float32
    assert np.allclose(single, aa.gradients.solve(arm, pose, seed)[..., 6:], rtol=0, atol=1e-3)


@pytest.mark.turns(8)
@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_all_ways_to_a_derivative_agree(name: str) -> None:
    """jacfwd, jacrev, jit and vmap in any order give `gradients.inverse`."""
    arm, q = postures(name, 12, 17, 34)
    kinematics = aa.jax.Kinematics(arm)
    pose, psi, gc = arm.forward(q)
    slope = aa.gradients.inverse(arm, pose, psi, gc)
    ahead = jax.vmap(jax.jacfwd(kinematics.inverse, argnums=1))(pose, psi, gc)
    back = jax.vmap(jax.jacrev(kinematics.inverse, argnums=1))(pose, psi, gc)
    assert np.allclose(ahead, slope[..., 6], rtol=1e-12, atol=1e-12)
    assert np.allclose(back, slope[..., 6], rtol=1e-12, atol=1e-12)
    by_pose = jax.jit(jax.vmap(jax.jacrev(kinematics.inverse)))(pose, psi, gc)
    for k, twist in enumerate(np.eye(6)):
        said = (by_pose * change(pose, twist)[:, None]).sum((-1, -2))
        assert np.allclose(said, slope[..., k], rtol=1e-12, atol=1e-12 * np.abs(slope).max())
    outside = jax.grad(lambda a: jax.vmap(kinematics.inverse)(pose, a, gc).sum())(psi)
    assert np.allclose(outside, slope[..., 6].sum(-1), rtol=1e-12, atol=1e-11)


def test_what_a_loss_leaves_out_counts_nothing() -> None:
    """Joints that a loss leaves out do not make its gradient NaN at a singularity; those in it do."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    kinematics = aa.jax.Kinematics(arm)
    pose, psi, gc = arm.forward(HOME)
    calm = jax.grad(lambda p: kinematics.inverse(p, psi, gc)[3:].sum())(pose)
    assert np.isfinite(calm).all() and np.any(calm)
    assert np.isnan(jax.grad(lambda p: kinematics.inverse(p, psi, gc).sum())(pose)[:3]).all()
    _, along = jax.jvp(lambda a: kinematics.inverse(pose, a, gc), (psi,), (1.0,))
    assert np.isnan(along[:3]).all() and np.isfinite(along[3:]).all()
    # the candle: forward has a derivative there, psi has none; stretched, inverse has one by psi alone
    candle = np.zeros(7)
    assert np.isfinite(jax.jacrev(lambda q: kinematics.forward(q)[0])(candle)).all()
    assert np.isnan(jax.grad(lambda q: kinematics.forward(q)[1])(candle)).all()
    stretched = arm.forward([0.3, 0.5, 0.2, 0.0, 0.1, 0.7, 0.4])
    by_pose, by_psi = jax.grad(lambda p, a: kinematics.inverse(p, a, stretched[2])[0], argnums=(0, 1))(
        *stretched[:2]
    )
    assert np.isnan(by_pose[:3]).all() and np.isfinite(by_psi)


def test_vmap_and_scan_are_the_batch() -> None:
    """vmap and scan of `inverse` equal its batch, derivatives too."""
    arm, q = postures("openarm_v10", 50, 17, 31)
    kinematics = aa.jax.Kinematics(arm)
    pose, psi, gc = arm.forward(q)
    wanted = arm.inverse(pose, psi, gc[0], limits=False)
    assert np.array_equal(jax.vmap(lambda p, a: kinematics.inverse(p, a, gc[0]))(pose, psi), wanted)
    assert np.array_equal(jax.vmap(kinematics.inverse, in_axes=(0, 0, None))(pose, psi, gc[0]), wanted)

    def walked(psi_now: object, frame: object) -> tuple[object, object]:
        """One cycle: the next psi and the joints."""
        return psi_now + 0.01, kinematics.inverse(frame, psi_now, gc[0])

    _, along = jax.jit(lambda frames: jax.lax.scan(walked, 0.2, frames))(pose)
    assert np.allclose(
        along, arm.inverse(pose, 0.2 + 0.01 * np.arange(len(q)), gc[0], limits=False), rtol=0, atol=1e-12
    )
    steep = jax.grad(lambda a: jax.lax.scan(walked, a, pose)[1].sum())(0.2)
    difference = [
        arm.inverse(pose, 0.2 + way * 1e-6 + 0.01 * np.arange(len(q)), gc[0], limits=False).sum()
        for way in (1, -1)
    ]
    assert np.isclose(steep, (difference[0] - difference[1]) / 2e-6, rtol=1e-5)


def test_what_has_no_answer_is_nan_and_what_is_no_pose_an_error() -> None:
    """Under jit `inverse` out of reach is NaN; what is no pose or gc raises and says which."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    kinematics = aa.jax.Kinematics(arm)
    near, psi, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    lost = np.full((4, 4), np.nan)
    poses = np.stack([near, aa.pose([9.0, 0.0, 0.0]), lost])
    found = jax.jit(kinematics.inverse)(poses, psi, gc)
    assert np.isfinite(found[0]).all() and np.isnan(found[1:]).all()
    assert np.isnan(kinematics.forward(np.full(7, np.nan))[0]).all()
    for pose, branch, words in (
        (2 * near, gc, "last row of pose"),
        (np.diag([1.0, 1.0, -1.0, 1.0]), gc, "reflection"),
        (np.diag([1.0, 1.2, 1.0, 1.0]), gc, "not orthonormal at element 1"),
        (near, 8, "gc is outside 0..7 at element 1"),
    ):
        with pytest.raises(jax.errors.JaxRuntimeError, match=words):
            jax.jit(kinematics.inverse)(
                np.stack([lost, pose]), psi, np.array([0, branch])
            ).block_until_ready()


def test_what_cannot_be_taken_is_said() -> None:
    """`jax.Kinematics` refuses wrong shapes and types."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    kinematics = aa.jax.Kinematics(arm)
    rows: list[tuple[Callable[[], object], str]] = [
        (lambda: kinematics.forward(np.zeros(6)), r"q has shape \(6,\)"),
        (lambda: kinematics.forward("here"), "q is not an array of real numbers"),
        (lambda: kinematics.forward(np.zeros(7, complex)), "q has type complex128"),
        (lambda: kinematics.inverse(np.eye(4), 0.0, 0.5), "gc has type float64"),
        (
            lambda: kinematics.inverse(np.zeros((3, 4, 4)), np.zeros(2), 0),
            "do not broadcast",
        ),
        (lambda: aa.jax.Kinematics(None), "arm is NoneType, wanted an Arm"),
    ]  # fmt: skip
    assert not_refused((aa.InputError, words, call) for call, words in rows) == []
