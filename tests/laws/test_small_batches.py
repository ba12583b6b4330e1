"""A batch of any length has the answers of its rows one by one, and the errors of its first wrong row."""

from __future__ import annotations

import numpy as np
import pytest
from support import draw
from support.calibrated import calibrated
from support.strategies import Array
from support.threads import in_threads

import armangle as aa

LENGTHS = (1, 2, 16, 17, 40)
ARMS = {
    "srs": aa.Arm.load("kuka_iiwa7_r800"), "offset": aa.Arm.load("franka_fr3"),
    "srs chain": calibrated("kuka_iiwa7_r800", 1.0, 1.0),
    "offset chain": calibrated("franka_fr3", 1.0, 1.0),
}  # fmt: skip


def rows(arm: aa.Arm, count: int) -> tuple[Array, Array, Array]:
    """Return random joints within the limits, their poses, some out of reach, and psi (0 if there is
    none).
    """
    rng = draw.generator(count)
    q = rng.uniform(np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi), (count, 7))
    pose, psi, _ = arm.forward(q, on_error="nan")
    pose[rng.random(count) < 0.2, 0, 3] += 5.0
    return q, pose, np.where(np.isfinite(psi), psi, 0.0)


@pytest.mark.turns(4)
@pytest.mark.parametrize("count", LENGTHS)
@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_a_batch_is_its_rows(arm: aa.Arm, count: int) -> None:
    """`forward`, `solve`, `feasible` and `inverse` of a batch equal those of its rows, also by two threads.

    `inverse` writes into `out=` and returns it.
    """
    seed, pose, psi = rows(arm, count)
    gc = np.arange(count) % arm.forward(seed)[2].max(initial=1)
    batch = arm.solve(pose, seed=seed)
    one_seed = arm.solve(pose, seed=seed[0])
    arcs = arm.feasible(pose, gc)
    q, out = arm.inverse(pose, psi, gc, on_error="nan"), np.empty((count, 7))
    assert arm.inverse(pose, psi, gc, on_error="nan", out=out) is out
    np.testing.assert_array_equal(out, q)
    two = in_threads(2, lambda: (arm.inverse(pose, psi, gc, on_error="nan"), arm.solve(pose, seed=seed)))
    np.testing.assert_array_equal(two[0], q)
    assert two[1] == batch
    there = arm.forward(seed)
    assert batch.q.shape == (count, 7) and batch.status.dtype == np.int8 and batch.gc.dtype == np.int64
    for i in range(count):
        for column, its in zip(there, arm.forward(seed[i]), strict=True):
            np.testing.assert_array_equal(column[i], its)
        for found, near in ((batch, seed[i]), (one_seed, seed[0])):
            row = arm.solve(pose[i], seed=near)
            for column, its in zip(found, row, strict=True):
                np.testing.assert_array_equal(np.asarray(column)[i], np.asarray(its))
        assert arcs[i] == arm.feasible(pose[i], int(gc[i]))
        np.testing.assert_array_equal(q[i], arm.inverse(pose[i], psi[i], int(gc[i]), on_error="nan"))


@pytest.mark.parametrize("count", LENGTHS)
def test_a_wrong_row_of_a_batch_is_refused(count: int) -> None:
    """A wrong last row of a batch of any length raises InputError."""
    arm = ARMS["srs"]
    seed, pose, psi = rows(arm, count)
    pose[:] = arm.forward(seed)[0]
    skewed, far = pose.copy(), pose.copy()
    skewed[-1, 0, 0] += 0.1
    far[-1, :3, 3] = 5000.0
    for wrong in (skewed, far):
        for ask in (
            lambda p: arm.solve(p, seed=seed),
            lambda p: arm.feasible(p, 0),
            lambda p: arm.inverse(p, psi, 0, limits=False),
        ):
            with pytest.raises(aa.InputError):
                ask(wrong)
    with pytest.raises(aa.InputError):
        arm.inverse(pose, psi, np.full(count, 8))
    with pytest.raises(aa.InputError):
        arm.solve(pose, seed=np.full((count, 7), np.nan))
    masked = np.ma.masked_array(pose, mask=np.zeros_like(pose, dtype=bool))
    masked[-1, 0, 0] = np.ma.masked
    with pytest.raises(aa.InputError):
        arm.solve(masked, seed=seed)
    if count > 1:
        with pytest.raises(aa.InputError):
            arm.solve(pose, seed=np.zeros((count + 1, 7)))
