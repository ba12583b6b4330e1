"""The wrist next to the shoulder: an arm of equal links folded to within nanometres of itself."""

from __future__ import annotations

import numpy as np
import pytest
from support import draw

import armangle as aa

REACH = 2.0
ARM = aa.Arm(d_bs=0.5, d_se=1.0, d_ew=1.0, d_wf=0.2)
ALONG_AXES = np.vstack([np.eye(3), -np.eye(3), [[0.6, 0.8, 0.0], [0.0, -0.6, 0.8], [1e-3, 0.0, 1.0]]])
DIRECTIONS = np.vstack([ALONG_AXES, draw.generator(1).normal(size=(draw.count(50), 3))])


@pytest.mark.parametrize("distance", [1e-11, 1e-9, 2.4e-8, 9.9e-8, 1.1e-7, 1e-6])
def test_a_wrist_next_to_the_shoulder_is_solved_in_every_direction(distance: float) -> None:
    """With the wrist nearly on the shoulder `inverse` holds the pose in all branches."""
    poses = np.repeat(np.eye(4)[None], len(DIRECTIONS), axis=0)
    unit = DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=1, keepdims=True)
    poses[:, :3, 3] = np.array([0, 0, 0.5 + 0.2]) + unit * distance * REACH
    for gc in range(8):
        q = ARM.inverse(poses, 0.7, gc, limits=False)
        again, psi, found = ARM.forward(q)
        assert np.abs(again - poses).max() < 1e-14
        assert np.isfinite(psi).all()
        assert not (ARM.feasible(poses, gc).status != aa.Status.OK).any()
        assert np.isin(found, [gc, gc ^ 1, gc ^ 4, gc ^ 5]).all()
