"""The viewer's goals for pytest-benchmark: from gizmo to picture under 50 ms, ready under 3 s.

    pytest benchmarks/test_viewer.py

The picture is what the server computes and sends; what a browser takes to draw it is its own.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip("pytest_benchmark")
pytest.importorskip("viser")

from pytest_benchmark.fixture import BenchmarkFixture

from armangle.cli import paper_example
from armangle.viewer import Viewer, ViewerState

_NUDGE = 0.02  # m, what a quick hand moves the tool between two events
_READY = """
from armangle.cli import paper_example
from armangle.viewer import Viewer, ViewerState
arm, start, _ = paper_example.example()
Viewer(ViewerState(arm, start), port=0).stop()
"""


@pytest.fixture
def viewer() -> Iterator[Viewer]:
    arm, start, _ = paper_example.example()
    running = Viewer(ViewerState(arm, start), port=0)
    running.scene.show_ghosts = True
    yield running
    running.stop()


def test_gizmo_to_picture(benchmark: BenchmarkFixture, viewer: Viewer) -> None:
    near = viewer.state.pose.copy()
    far = near.copy()
    far[:3, 3] += _NUDGE * near[:3, 2]
    poses = [far, near]

    def drag() -> None:
        poses.reverse()
        viewer.act(lambda: viewer.state.set_pose(poses[0]), gizmo=False)

    benchmark(drag)
    benchmark.extra_info["ms"] = 1e3 * benchmark.stats.stats.median
    assert np.isfinite(viewer.state.q).all()


def test_ready(benchmark: BenchmarkFixture) -> None:
    benchmark.pedantic(lambda: subprocess.run([sys.executable, "-c", _READY], check=True), rounds=3)
