"""Whole paths: pytest benchmarks/test_plan.py (the normal run of the tests does not collect this)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support.threads import in_threads

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


def waves(arm: aa.Arm, number: int) -> list[np.ndarray]:
    """Waves about random lines of 0.2 m, in reach all along, each as 250 poses."""
    rng = np.random.default_rng(0)
    low, high = np.maximum(arm.lower, -2.9), np.minimum(arm.upper, 2.9)
    s = np.linspace(0, 1, 250)[:, None]
    found: list[np.ndarray] = []
    while len(found) < number:
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        pose = arm.forward((low + high) / 2 + 0.35 * (high - low) * rng.uniform(-1, 1, 7))[0]
        poses = np.repeat(pose[None], len(s), axis=0)
        poses[:, :3, 3] += 0.2 * s * way + 0.05 * np.sin(2 * np.pi * s) * np.cross(way, [0, 0, 1])
        if arm.solve(poses).ok.all():
            found.append(poses)
    return found


@pytest.mark.parametrize("threads", [1, 0])
def test_250_poses_all_branches(benchmark: Any, threads: int) -> None:
    """Goal: 50 ms, planned and certified."""
    path = benchmark(lambda: in_threads(threads, lambda: aa.plan(ARM, line(250))))
    assert path.certified


@pytest.mark.parametrize("threads", [1, 0])
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "realman_rm75_b", "openarm_v10"])
def test_20_waves_of_250_poses(benchmark: Any, name: str, threads: int) -> None:
    """Goal: 1 s, 50 ms each."""
    arm = aa.Arm.from_catalogue(name)
    paths = waves(arm, 20)
    benchmark.pedantic(lambda: in_threads(threads, lambda: [aa.plan(arm, each) for each in paths]), rounds=3)


def test_100_000_poses(benchmark: Any) -> None:
    """Goal: 20 s."""
    path = benchmark.pedantic(aa.plan, (ARM, line(100_000)), rounds=1)
    assert path.ok
