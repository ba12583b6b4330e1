"""Over a short line a plan stays beside its start, however near a limit or a singularity that stands."""

from __future__ import annotations

import numpy as np
import pytest
from support.draw import count, generator

import armangle as aa

ARMS = ("kuka_iiwa7_r800", "schunk_lwa4p_extended", "rainbow_rby1_left", "openarm_v10", "realman_rm75_b")
HINGES = (0.05, 0.01, 0.005, 0.002, 1e-3, 1e-4, 1e-6, 0.0)
"""Of theta_2 or theta_6, rad."""
LENGTHS = (1e-9, 1e-6, 1e-4, 1e-3)  # m
ROWS = 50
SLACK, PER_METRE = 1e-5, 40.0
"""What a joint may travel beyond the least motion: rad, and rad for each metre, for the sake of margins."""


def case(arm: aa.Arm, hinge: float, length: float, rng: np.random.Generator) -> tuple[np.ndarray, aa.Line]:
    """A posture well within its limits with one hinge near 0, and a line of the tool from there."""
    joint = rng.choice([1, 5])
    room = 0.1 * (arm.upper - arm.lower)
    q = rng.uniform(arm.lower + room, arm.upper - room)
    q[joint] = arm.geometry.signs[joint] * (hinge * rng.choice([-1, 1]) - arm.geometry.offsets[joint])
    first = arm.forward(q, on_error="nan")[0]
    last, way = first.copy(), rng.normal(size=3)
    last[:3, 3] += length * way / np.linalg.norm(way)
    return q, aa.Line(first, last)


def least_motion(arm: aa.Arm, q: np.ndarray, path: aa.Line) -> np.ndarray | None:
    """Joints (ROWS, 7) of the least motion along a path from q; None if it does not keep the limits."""
    rows = [q]
    for pose in path.pose(np.linspace(0, 1, ROWS))[1:]:
        now = rows[-1]
        for _ in range(20):
            here = arm.forward(now, on_error="nan")[0]
            turn = 0.5 * np.cross(here[:3, :3].T, pose[:3, :3].T).sum(axis=0)
            off = np.concatenate([pose[:3, 3] - here[:3, 3], turn])
            if np.abs(off).max() < 1e-13:
                break
            now = now + np.linalg.pinv(arm.jacobian(now), rcond=1e-4) @ off
        if np.abs(off).max() > 1e-12 or not arm.within_limits(now):
            return None
        rows.append(now)
    return np.array(rows)


def travel(q: np.ndarray) -> float:
    """The distance (rad) that the joint that travels most travels."""
    return float(np.abs(np.diff(q, axis=0)).sum(axis=0).max())


@pytest.mark.turns(6)
@pytest.mark.parametrize("length", LENGTHS)
@pytest.mark.parametrize("name", ARMS)
def test_a_short_line_moves_no_joint_farther_than_the_least_motion_does(name: str, length: float) -> None:
    """A short plan near a singularity moves joints hardly more than the least motion."""
    arm, rng, compared = aa.Arm.from_catalogue(name), generator(41, round(1e9 * length)), 0
    for hinge in HINGES * count(1, len(ARMS) * len(LENGTHS) * len(HINGES)):
        q, path = case(arm, hinge, length, rng)
        least = least_motion(arm, q, path)
        if least is None:
            continue
        compared += 1
        result = aa.plan(arm, path, start=q, samples=200)
        assert result.certified, (q, path.end[:3, 3] - path.start[:3, 3], result.explain())
        assert travel(result.q) <= 1.15 * travel(least) + SLACK + PER_METRE * length, (q, path.end)
    assert compared


def test_a_tool_at_rest_leaves_the_arm_at_rest() -> None:
    """A plan at one pose moves no joint, unless another psi is wished."""
    arm, rng = aa.Arm.from_catalogue("kuka_iiwa7_r800"), generator(42)
    for hinge in HINGES:
        q, path = case(arm, hinge, 0.0, rng)
        still = aa.plan(arm, path, start=q)
        assert still.certified and travel(still.q) < 1e-3, (q, travel(still.q))
    q, path = case(arm, 0.5, 0.0, rng)
    psi = float(arm.forward(q)[1])
    wished = aa.plan(arm, path, start=q, psi=psi + 0.1, objective=aa.Objective(psi=100))
    assert wished.certified and wished.psi[-1] == pytest.approx(psi + 0.1, abs=0.03)
