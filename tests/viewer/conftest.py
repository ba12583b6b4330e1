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
    """The viewer's state with the paper's arm at the start of its example."""
    return ViewerState(PAPER_ARM, PAPER_Q)


def paper_motion() -> aa.JointPath:
    """The paper's line, followed."""
    return aa.follow(PAPER_ARM, PAPER_POSES, start=PAPER_Q, max_joint_step=np.inf)


@pytest.fixture
def served() -> Iterator[Served]:
    """Return a function that starts a viewer on a free port; all are stopped after the test."""
    need("viser")
    running: list[Viewer] = []

    def begin(state: ViewerState | None = None, *words: Any) -> Viewer:
        """Start a viewer of this state, else of the paper's arm."""
        running.append(Viewer(state or paper(), *words, port=0))
        return running[-1]

    yield begin
    for viewer in running:
        viewer.stop()
