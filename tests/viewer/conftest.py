"""The paper's arm in the viewer, and servers that are stopped when a test ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from support.needs import need

import armangle as aa
from armangle.cli import paper_example
from armangle.viewer import Viewer, ViewerState

PAPER_ARM, PAPER_Q, PAPER_POSES = paper_example.example()
Served = Callable[..., Viewer]


def paper() -> ViewerState:
    return ViewerState(PAPER_ARM, PAPER_Q)


def paper_motion() -> aa.JointPath:
    return aa.follow(PAPER_ARM, PAPER_POSES, start=PAPER_Q, max_joint_step=np.inf)


@pytest.fixture
def served() -> Iterator[Served]:
    """Begin a viewer on a free port."""
    need("viser")
    running: list[Viewer] = []

    def begin(state: ViewerState | None = None, *words: Any) -> Viewer:
        """Start a viewer that is stopped after the test."""
        running.append(Viewer(state or paper(), *words, port=0))
        return running[-1]

    yield begin
    for viewer in running:
        viewer.stop()
