"""Robotics Toolbox for Python beside armangle: one robot, one meaning of joints."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support import draw
from support.needs import need

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")


@pytest.fixture
def chain(tmp_path: Path) -> Any:
    """The arm in Robotics Toolbox."""
    file = tmp_path / "iiwa.urdf"
    file.write_text(ARM.to_urdf(), encoding="utf-8")
    return need("roboticstoolbox").Robot.URDF(str(file)).ets()


def test_both_have_one_forward_and_one_jacobian(chain: Any) -> None:
    """Both libraries have equal poses and Jacobians; `solve` gives back the joints."""
    for q in draw.generator(17, 51).uniform(ARM.lower, ARM.upper, (50, 7)):
        pose = ARM.forward(q)[0]
        assert np.allclose(chain.eval(q), pose, rtol=0, atol=1e-12)
        assert np.allclose(chain.jacob0(q), ARM.jacobian(q), rtol=0, atol=1e-12)
        found = ARM.solve(pose, seed=q)
        assert found.ok and np.allclose(found.q, q, rtol=0, atol=1e-9)


def test_a_pose_of_its_kind_is_taken() -> None:
    """`solve` takes an SE3 of spatialmath."""
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    frame = need("spatialmath").SE3(ARM.forward(q)[0])
    assert np.allclose(ARM.solve(frame, seed=q).q, q, rtol=0, atol=1e-9)


def test_its_answer_is_no_nearer_than_ours(chain: Any) -> None:
    """`solve` is at most 1e-3 rad farther from the seed than ik_LM (within 1e-6 m of the pose) if that
    succeeds.
    """
    answered, rng = 0, draw.generator(17, 52)
    for _ in range(40):
        goal = ARM.forward(rng.uniform(ARM.lower, ARM.upper))[0]
        near = rng.uniform(ARM.lower, ARM.upper)
        answer = chain.ik_LM(goal, q0=near, joint_limits=True)
        mine = ARM.solve(goal, seed=near)
        assert mine.ok
        if not answer.success:
            continue
        answered += 1
        assert mine.distance <= np.linalg.norm(answer.q - near) + 1e-3  # it stops at 1e-6 m
    assert answered > 20
