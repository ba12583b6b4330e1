"""All eight branches at once are the eight branches one by one."""

from __future__ import annotations

import numpy as np
import pytest

import armangle as aa
from armangle.models.catalogue import srs_catalogue

POSES = 300


@pytest.mark.parametrize("name", srs_catalogue())
@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_feasible_all_is_feasible_of_each(name: str, margin: float) -> None:
    arm = aa.Arm.from_catalogue(name)
    rng = np.random.default_rng(7)
    bound = np.pi
    q = rng.uniform(np.maximum(arm.lower, -bound), np.minimum(arm.upper, bound), (POSES, 7))
    q[: POSES // 10, 1] = -arm.offsets[1] * arm.signs[1]  # theta_2 = 0
    pose, _, _ = arm.forward(q)
    pose[-1, :3, 3] += 10.0 * arm.reach  # out of reach
    together = arm.with_(singularity_margin=margin).feasible(pose)
    one_by_one = arm.with_(singularity_margin=margin).feasible(pose[:, None], np.arange(8))
    assert together.shape == (POSES, 8)
    assert together == one_by_one
    assert np.array_equal(together.status, one_by_one.status)
    assert together[3].ends == one_by_one[3].ends
    assert together[-1, 0].status is aa.Status.UNREACHABLE


def test_feasible_all_of_one_pose() -> None:
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    pose, psi, gc = arm.forward([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    arcs = arm.feasible(pose)
    assert arcs.shape == (8,)
    assert psi in arcs[gc]
