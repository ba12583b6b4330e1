"""Whole paths: pytest benchmarks/test_plan.py (the normal run of the tests does not collect this)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import armangle as aa

pytest.importorskip("pytest_benchmark")

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
START = np.radians([-5.4101, -26.4986, -48.1542, -61.65, 152.6198, 114.4466, 8.1812])


def line(count: int) -> np.ndarray:
    """The paper's line (section 6.2) as poses, (count, 4, 4)."""
    pose = ARM.forward(START)[0]
    poses = np.repeat(pose[None], count, axis=0)
    poses[:, :3, 3] += np.linspace(0, 0.25, count)[:, None] * pose[:3, 2]
    return poses


def test_250_poses_all_branches(benchmark: Any) -> None:
    """Goal: 50 ms, planned and certified."""
    path = benchmark(aa.plan, ARM, line(250))
    assert path.certified


def test_100_000_poses(benchmark: Any) -> None:
    """Goal: 20 s."""
    path = benchmark.pedantic(aa.plan, (ARM, line(100_000)), rounds=1)
    assert path.ok
