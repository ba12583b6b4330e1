"""The operators of torch: the numbers of Arm, gradients against differences, compiled, mapped, refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from support import draw
from support.gradients import FAMILIES, HOME, change, moved, postures
from support.needs import need
from support.refused import not_refused

import armangle as aa

torch = need("torch")


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", FAMILIES)
def test_the_numbers_are_those_of_arm(name: str) -> None:
    """Functions of `torch.Kinematics` equal those of Arm to the bit, in float32 roughly."""
    arm, q = postures(name, 40, 17, 21)
    kinematics = aa.torch.Kinematics(arm)
    joints = torch.from_numpy(q)
    pose, psi, gc = kinematics.forward(joints)
    for found, wanted in zip((pose, psi, gc), arm.forward(q), strict=True):
        assert np.array_equal(found.numpy(), wanted)
    assert np.array_equal(
        kinematics.inverse(pose, psi, gc).numpy(), arm.inverse(*arm.forward(q), limits=False)
    )
    assert np.array_equal(kinematics.freedom(pose).numpy(), arm.freedom(pose.numpy()).total)
    assert np.array_equal(kinematics.limit_margin(joints).numpy(), arm.limit_margin(q))
    single = kinematics.inverse(pose.float(), psi.float(), gc)
    assert single.dtype == torch.float32 and np.allclose(single, kinematics.inverse(pose, psi, gc), atol=1e-2)


@pytest.mark.parametrize("name", FAMILIES)
def test_gradients_are_the_limit_of_differences(name: str) -> None:
    """backward of `forward` and `inverse` equals differences."""
    arm, q = postures(name, 30, 17, 21)
    kinematics = aa.torch.Kinematics(arm)
    rng, step = draw.generator(17, 22), 1e-6
    weight, twist = rng.normal(size=(len(q), 7)), rng.normal(size=(len(q), 7))
    pose, psi, gc = arm.forward(q)
    given = [torch.from_numpy(value).requires_grad_() for value in (pose, psi)]
    found = kinematics.inverse(*given, torch.from_numpy(gc))
    (torch.from_numpy(weight) * found).sum().backward()
    ahead, behind = (
        arm.inverse(
            moved(pose, way * step * twist[:, :6]), psi + way * step * twist[:, 6], gc, seed=q, limits=False
        )
        for way in (1, -1)
    )
    difference = (weight * (ahead - behind)).sum(-1) / (2 * step)
    said = (given[0].grad.numpy() * change(pose, twist[:, :6])).sum((-1, -2)) + given[1].grad.numpy() * twist[
        :, 6
    ]
    assert np.allclose(said, difference, rtol=1e-5, atol=1e-5 * np.abs(difference).max())
    # forward, of the pose and of psi
    joints = torch.from_numpy(q).requires_grad_()
    by_pose, by_psi = rng.normal(size=(len(q), 4, 4)), rng.normal(size=len(q))
    pose_of, psi_of, _ = kinematics.forward(joints)
    ((torch.from_numpy(by_pose) * pose_of).sum() + (torch.from_numpy(by_psi) * psi_of).sum()).backward()
    ends = [arm.forward(q + way * step * weight)[:2] for way in (1, -1)]
    turned = (ends[0][1] - ends[1][1] + np.pi) % (2 * np.pi) - np.pi
    difference = ((by_pose * (ends[0][0] - ends[1][0])).sum((-1, -2)) + by_psi * turned) / (2 * step)
    assert np.allclose((joints.grad.numpy() * weight).sum(-1), difference, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "franka_fr3", "fetch", "calibrated kinova_movo"])
def test_gradients_of_freedom_and_of_the_limit_margin(name: str) -> None:
    """backward of `freedom` equals differences, and of `limit_margin` is ±1 for the nearest joint."""
    arm, q = postures(name, 60, 17, 21)
    kinematics, rng, step = aa.torch.Kinematics(arm), draw.generator(17, 23), 1e-7
    pose = arm.forward(q)[0]
    given = torch.from_numpy(pose).requires_grad_()
    kinematics.freedom(given).sum().backward()
    twist = rng.normal(size=(len(q), 6))
    ends = [arm.freedom(moved(pose, way * step * twist)) for way in (1, -1)]
    difference = (ends[0].total - ends[1].total) / (2 * step)
    said = (given.grad.numpy() * change(pose, twist)).sum((-1, -2))
    # where an arc is born, or an end meets a touching joint, there is no slope that a difference could see
    known = (ends[0].arcs == ends[1].arcs) & (np.abs(said) < 50)
    assert known.sum() > 0.6 * len(q)
    assert np.allclose(said[known], difference[known], rtol=1e-3, atol=1e-4)
    joints = torch.from_numpy(q).requires_grad_()
    kinematics.limit_margin(joints).sum().backward()
    off = np.minimum(q - arm.lower, arm.upper - q).argmin(-1)
    rows = np.arange(len(q))
    sign = np.where((q - arm.lower)[rows, off] < (arm.upper - q)[rows, off], 1.0, -1.0)
    wanted = np.zeros_like(q)
    wanted[rows, off] = sign
    assert np.array_equal(joints.grad.numpy(), wanted)


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "franka_fr3", "fetch", "calibrated kinova_movo"])
@pytest.mark.parametrize("prefer", ["seed", "margin"])
def test_gradients_go_through_solve(prefer: str, name: str) -> None:
    """`torch.Kinematics.solve` equals Arm's, and its backward `gradients.solve`."""
    arm, q = postures(name, 30, 17, 24)
    kinematics, rng = aa.torch.Kinematics(arm), draw.generator(17, 25)
    seed, weight = q + rng.normal(size=q.shape), torch.from_numpy(rng.normal(size=q.shape))
    pose = arm.forward(q)[0]
    given = [torch.from_numpy(value).requires_grad_() for value in (pose, seed)]
    found, psi, gc, ok = kinematics.solve(*given, prefer=prefer)
    wanted = arm.solve(pose, seed, prefer=prefer)
    for one, other in zip(
        (found.detach(), psi, gc, ok), (wanted.q, wanted.psi, wanted.gc, wanted.ok), strict=True
    ):
        assert np.array_equal(one.numpy(), other)
    slopes = aa.gradients.solve(arm, pose, seed, prefer=prefer)
    known = torch.from_numpy(np.isfinite(slopes).all(axis=(1, 2)))
    assert known.sum() > 0.3 * len(q)
    (weight * found)[known].sum().backward()
    twist = rng.normal(size=(len(q), 6))
    said = (given[0].grad.numpy() * change(pose, twist)).sum((-1, -2))
    row = (weight.numpy()[..., None] * slopes).sum(-2)[known]
    assert np.allclose(said[known], (row[:, :6] * twist[known]).sum(-1), rtol=1e-9, atol=1e-9)
    if prefer == "margin":
        assert given[1].grad is None  # the seed is not asked
    else:
        assert np.allclose(given[1].grad.numpy()[known], row[:, 6:], rtol=1e-12, atol=1e-12)
    assert not given[0].grad[~known].any()


@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "franka_fr3", "fetch", "calibrated kinova_movo"])
def test_gradcheck_of_solve(name: str) -> None:
    """`gradcheck` accepts `solve` after `forward`."""
    arm, q = postures(name, 40, 17, 27)
    kinematics = aa.torch.Kinematics(arm)
    start = torch.from_numpy(q[arm.limit_margin(q).argmax()])
    seed = (start + 0.2).requires_grad_()
    change_of = torch.zeros(7, dtype=torch.float64, requires_grad=True)

    def answer(seed: Any, turn: Any) -> Any:
        """The joints of `solve` for the pose of moved joints."""
        return kinematics.solve(kinematics.forward(start + turn)[0], seed)[0]

    assert torch.autograd.gradcheck(answer, (seed, change_of), eps=1e-6, atol=1e-6)


def test_a_masked_element_out_of_reach_leaves_the_gradient_of_the_others() -> None:
    """Gradients of elements within reach are finite though another one is NaN."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    kinematics = aa.torch.Kinematics(arm)
    near, _, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    poses = torch.from_numpy(np.stack([near, aa.pose([9.0, 0.0, 0.0])])).requires_grad_()
    psi = torch.zeros(2, dtype=torch.float64)
    q = kinematics.inverse(poses, psi, int(gc), on_error="nan")
    assert q[1].isnan().all()
    q[0].sum().backward()
    assert poses.grad.isfinite().all() and poses.grad[0].any() and not poses.grad[1].any()
    with pytest.raises(aa.UnreachableError, match=r"pose\[1\] is out of reach"):
        kinematics.inverse(poses, psi, int(gc))


def test_a_gradient_that_does_not_exist_is_refused_or_nan() -> None:
    """backward at a singularity raises and says where, or is NaN on request, if a loss uses those joints."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    kinematics = aa.torch.Kinematics(arm)
    calm, stretched = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]), [0.3, 0.5, 0.2, 0.0, 0.1, 0.7, 0.4]
    pose, psi, gc = (torch.from_numpy(v) for v in arm.forward(np.stack([calm, HOME, stretched])))

    def gradients(weight: np.ndarray, on_error: str = "raise") -> list[np.ndarray]:
        """The gradients by pose and psi of the weighted joints."""
        given = [value.clone().requires_grad_() for value in (pose, psi)]
        found = kinematics.inverse(*given, gc, on_error=on_error)
        return [g.numpy() for g in torch.autograd.grad((found * torch.from_numpy(weight)).sum(), given)]

    weight = np.zeros((3, 7))
    weight[0] = 1
    weight[1, 3:] = 1  # θ2 is 0: joints 1 to 3 are left out
    by_pose, by_psi = gradients(weight)
    assert np.isfinite(by_pose).all() and np.isfinite(by_psi).all() and by_pose[:2].any(axis=(1, 2)).all()
    weight[1] = 1
    with pytest.raises(aa.UnreachableError, match=r"no gradient at pose\[1\], where θ2 is 0 or π"):
        gradients(weight)
    by_pose, by_psi = gradients(weight, "nan")
    assert np.isnan(by_pose[1, :3]).all() and np.isnan(by_psi[1]) and np.isfinite(by_pose[[0, 2]]).all()
    weight[1:, :] = [[0], [1]]
    with pytest.raises(aa.UnreachableError, match=r"pose\[2\], where the elbow is stretched or folded"):
        gradients(weight)
    by_pose, by_psi = gradients(weight, "nan")
    assert np.isnan(by_pose[2, :3]).all() and np.isfinite(by_psi).all()  # psi turns the stretched arm too


def test_forward_has_its_gradient_at_the_candle() -> None:
    """With the arm straight up `forward` has a gradient of the pose, and of psi raises or is NaN."""
    kinematics = aa.torch.Kinematics(aa.Arm.from_catalogue("kuka_iiwa7_r800"))
    q = torch.zeros(7, dtype=torch.float64, requires_grad=True)
    pose, psi, _ = kinematics.forward(q)
    (by_pose,) = torch.autograd.grad(pose[:3, 3].sum() + 0 * psi, q, retain_graph=True)
    assert np.allclose(by_pose, kinematics.arm.jacobian(np.zeros(7))[:3].sum(axis=0), rtol=0, atol=1e-15)
    with pytest.raises(aa.UnreachableError, match="no gradient at q, where the wrist lies so that its arm"):
        psi.backward()
    _, psi, _ = kinematics.forward(q, on_error="nan")
    psi.backward()
    assert q.grad.isnan().all()


@pytest.mark.slow
def test_opcheck_passes() -> None:
    """`torch.library.opcheck` accepts all operators."""
    arm, q = postures("kuka_iiwa7_r800", 8, 17, 21)
    kinematics = aa.torch.Kinematics(arm)
    pose, psi, gc = (torch.from_numpy(value) for value in arm.forward(q))
    joints = torch.from_numpy(q)
    pose, psi, joints = (value.requires_grad_() for value in (pose, psi, joints))
    key = kinematics._key
    for operator, arguments in (
        (torch.ops.armangle.forward, (joints, key, False)),
        (torch.ops.armangle.inverse, (pose, psi, gc, key, False)),
        (torch.ops.armangle.freedom, (pose, key)),
        (torch.ops.armangle.solve, (pose, joints, key, False)),
        (torch.ops.armangle.limit_margin, (joints, key)),
    ):
        assert set(torch.library.opcheck(operator.default, arguments).values()) == {"SUCCESS"}


@pytest.mark.slow
def test_it_compiles_without_a_break() -> None:
    """A compiled function has the values and gradients of the plain one to the bit, without graph breaks."""
    arm, q = postures("kuka_iiwa7_r800", 20, 17, 21)
    kinematics = aa.torch.Kinematics(arm)

    def away(joints: object, turn: object) -> object:
        """A sum of results of all functions."""
        pose, psi, gc = kinematics.forward(joints)
        return (
            kinematics.limit_margin(kinematics.inverse(pose, psi + turn, gc)).sum()
            + kinematics.freedom(pose).sum()
            + kinematics.solve(pose, joints.detach() + turn[:, None])[0].sum()
        )

    compiled = torch.compile(away, fullgraph=True, backend="aot_eager")
    results = []
    for function in (away, compiled):
        joints = torch.from_numpy(q).requires_grad_()
        turn = torch.full((len(q),), 0.01, dtype=torch.float64, requires_grad=True)
        value = function(joints, turn)
        value.backward()
        results.append((value.detach(), joints.grad, turn.grad))
    for plain, fused in zip(*results, strict=True):
        assert torch.equal(plain, fused)


def test_vmap_is_the_batch() -> None:
    """vmap of `inverse` and `forward` equals their batch."""
    arm, q = postures("openarm_v10", 20, 17, 21)
    kinematics = aa.torch.Kinematics(arm)
    pose, psi, gc = (torch.from_numpy(value) for value in arm.forward(q))
    mapped = torch.func.vmap(lambda p, a: kinematics.inverse(p, a, gc[0]))(pose, psi)
    assert torch.equal(mapped, kinematics.inverse(pose, psi, gc[0]))
    poses, angles, branches = torch.func.vmap(kinematics.forward, in_dims=1)(
        torch.from_numpy(q).T.contiguous()
    )
    assert torch.equal(poses, pose) and torch.equal(angles, psi) and torch.equal(branches, gc)


def test_what_cannot_be_taken_is_said() -> None:
    """`torch.Kinematics` refuses wrong types, shapes and devices."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    kinematics = aa.torch.Kinematics(arm)
    pose = torch.eye(4, dtype=torch.float64)
    rows: list[tuple[Callable[[], object], str]] = [
        (lambda: kinematics.forward(np.zeros(7)), "q is ndarray, wanted a torch.Tensor"),
        (lambda: kinematics.forward(torch.zeros(7).long()), "q has type torch.int64"),
        (lambda: kinematics.forward(torch.zeros(6)), r"q has shape \(6,\)"),
        (lambda: kinematics.forward(torch.zeros(7, device="meta")), "a tensor on meta"),
        (lambda: kinematics.inverse(pose, 0.0, 0.5), "gc has type torch.float32"),
        (lambda: kinematics.inverse(pose, 0.0, 9), "gc is 9"),
        (lambda: kinematics.inverse(2 * pose, 0.0, 0), "last row"),
        (
            lambda: kinematics.inverse(pose.expand(3, 4, 4), torch.zeros(2).double(), 0),
            "do not broadcast",
        ),
        (lambda: kinematics.inverse(pose, 0.0, 0, on_error="no"), "on_error is 'no'"),
        (lambda: aa.torch.Kinematics("iiwa"), "arm is str, wanted an Arm"),
        (lambda: torch.ops.armangle.limit_margin(torch.zeros(7), 1), "does not know the arm"),
    ]  # fmt: skip
    assert not_refused((aa.InputError, words, call) for call, words in rows) == []
