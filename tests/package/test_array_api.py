"""The example of the formulas on the array API: NumPy, torch and JAX have the joints of the core."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import draw
from support.needs import need

import armangle as aa

FILE = Path(__file__).resolve().parents[2] / "contrib" / "array_api_inverse.py"
OFFSETS = [0.1, -0.2, 0.3, 0.0, 0.5, -0.6, 0.7]
MOVED = aa.pose([0.1, 0.2, 0.3], rpy=[0.5, 0.4, 0.3])


@pytest.fixture(scope="module")
def inverse() -> Any:
    """The function `inverse` of the example."""
    need("array_api_compat")
    spec = importlib.util.spec_from_file_location("array_api_inverse", FILE)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.inverse


def arm() -> aa.Arm:
    """An arm of all signs, with zero offsets, a base and a tool; without limits, so that any turn will do."""
    signs = [1, -1, 1, -1, 1, -1, 1]
    lengths = {"d_bs": 0.3, "d_se": 0.42, "d_ew": 0.36, "d_wf": 0.1}
    return aa.Arm(**lengths, signs=signs, offsets=OFFSETS, base=MOVED, tool=MOVED)


def asked(count: int) -> tuple[Any, Any, Any]:
    """Poses, psi and gc of up to `count` random postures away from singularities."""
    q = draw.generator(17, 41).uniform(-3, 3, (count, 7))
    hinges = (arm().geometry.signs * q + arm().geometry.offsets)[:, [1, 3, 5]]
    return arm().forward(q[(np.abs(np.sin(hinges)) > 0.1).all(axis=1)])


@pytest.mark.parametrize("library", ["numpy", "torch", "jax"])
def test_the_joints_are_those_of_the_core(inverse: Any, library: str) -> None:
    """The example has the joints of `Arm.inverse`, up to turns, with NumPy, torch and (in float32) JAX."""
    pose, psi, gc = asked(200)
    wanted, tolerance = arm().inverse(pose, psi, gc, limits=False), 1e-11
    if library == "torch":
        pose, psi, gc = (need("torch").from_numpy(value) for value in (pose, psi, gc))
    if library == "jax":  # in its own float32
        pose, psi, gc = (need("jax.numpy").asarray(value) for value in (pose, psi, gc))
        tolerance = 2e-4
    found = np.asarray(inverse(arm(), pose, psi, gc))
    off = (found - wanted + np.pi) % (2 * np.pi) - np.pi
    assert len(found) > 100 and np.abs(off).max() < tolerance


def test_the_framework_differentiates_it(inverse: Any) -> None:
    """The derivative that torch has of the example is `Arm.self_motion`."""
    torch = need("torch")
    pose, psi, gc = (torch.from_numpy(value) for value in asked(60))
    _, slope = torch.autograd.functional.jvp(
        lambda angle: inverse(arm(), pose, angle, gc), psi, torch.ones_like(psi)
    )
    assert np.allclose(slope, arm().self_motion(pose.numpy(), psi.numpy(), gc.numpy()), rtol=1e-8, atol=1e-8)
