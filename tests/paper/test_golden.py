"""The paper's own example, section 6.2, and the numbers that belong to it.

Joints (37), pose (38) and goal (39) are printed in Faria et al. (2018). GC = 3 is the paper's; psi and the
feasible arcs were computed once by the second implementation in tests/reference and by sampling, to the
digits given.
"""

from __future__ import annotations

import numpy as np
import pytest
from reference import paper
from support.laws import gap

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
JOINTS = paper.THETA_START
PSI_DEG = 58.58816372916817
ARCS_DEG = [[-22.82, 24.88], [42.70, 322.07]]


def test_the_start_pose_of_the_paper() -> None:
    pose, psi, gc = ARM.forward(JOINTS)
    assert gap(pose, paper.POSE_START) <= 6e-5  # as printed
    assert gc == 3
    assert np.degrees(psi) == pytest.approx(PSI_DEG, abs=1e-11)
    assert gap(ARM.inverse(pose, psi, gc, limits=False), JOINTS) <= 1e-12


def test_the_feasible_arcs_of_the_start_pose() -> None:
    pose, psi, gc = ARM.forward(JOINTS)
    arcs = ARM.feasible(pose, gc)
    assert gap(np.degrees(arcs.intervals), np.array(ARCS_DEG)) <= 5e-3
    assert psi in arcs
    assert arcs.status is aa.Status.OK


def test_the_goal_of_the_paper_is_reached_along_the_tool_axis() -> None:
    pose, _, gc = ARM.forward(JOINTS)
    poses = np.repeat(pose[None], 251, axis=0)
    poses[:, :3, 3] += np.linspace(0, 0.25, 251)[:, None] * pose[:3, 2]
    assert gap(poses[-1], paper.POSE_GOAL) <= 6e-5
    path = aa.follow(ARM, poses, start=JOINTS, policy=aa.Repulsion(K=0.1, alpha=20))
    assert path.ok
    assert (path.gc == gc).all()
    assert gap(ARM.forward(path.q[-1])[0], poses[-1]) <= 1e-12
    assert path.margin.min() > 0
