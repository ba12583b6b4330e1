"""Small reach maps for tests: made here, or in a process of its own that can be killed."""

from __future__ import annotations

import functools
import hashlib
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import armangle as aa
from armangle.reach import grid
from support import draw

ARMS = ("openarm_v10", "human_arm_left")
"""Joints 1 and 7 of these turn less than fully: what assumes more is right on an iiwa and wrong here."""
OFFSET_ARMS = ("franka_fr3", "fetch")
"""An offset at the wrist, and one at the shoulder."""
STORED = ARMS if draw.COUNT else ARMS[:1]
CLUSTERED = ARMS if draw.COUNT else ARMS[1:]
"""How a map is written, killed and resumed is no matter of the arm: `make thorough` takes both."""
CELLS = 2**15

_SCRIPT = """
import sys
import armangle as aa
from armangle.reach import grid
grid._CELLS = int(sys.argv[3])
client = None
if {cluster}:
    import distributed
    client = distributed.Client(distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=60
    ))
aa.set_threads({threads})
arm = aa.Arm.from_catalogue(sys.argv[1])
aa.reach_map(arm, sys.argv[2], spacing={spacing}, tilt={tilt}, scheduler=client)
if {peak}:
    lines = dict(line.split(":", 1) for line in open("/proc/self/status"))  # ru_maxrss is the parent's too
    print(int(lines["VmHWM"].split()[0]) / 1024)
"""


def small_tiles(monkeypatch: pytest.MonkeyPatch, cells: int = CELLS) -> None:
    """Set the size of tiles to about this many cells."""
    monkeypatch.setattr(grid, "_CELLS", cells)


def made(
    name: str, place: Path, *, spacing: float = 0.05, tilt: float = 0.2, margin: float = 0.0, **options: Any
) -> aa.ReachMap:
    """Compute the map of an arm of the catalogue in the folder `place`, with `margin` (rad) to singularities;
    with these defaults it has a few tiles.
    """
    arm = aa.Arm.from_catalogue(name).with_(singularity_margin=margin)
    return aa.reach_map(arm, place, spacing=spacing, tilt=tilt, **options)


def process(
    name: str, place: Path, *, spacing: float, tilt: float, cluster: bool = False
) -> subprocess.Popen[str]:
    """Start a process that computes a map, by two threads or a Dask worker; `spacing` (m), `tilt` (rad)."""
    script = _SCRIPT.format(spacing=spacing, tilt=tilt, cluster=cluster, threads=2, peak=False)
    words = [sys.executable, "-c", script, name, str(place), str(CELLS)]
    return subprocess.Popen(
        words, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )


def peak(name: str, place: Path, *, spacing: float, tilt: float) -> float:
    """The largest memory (MiB) of a process that computes a map with one thread and the present size of
    tiles.
    """
    script = _SCRIPT.format(spacing=spacing, tilt=tilt, cluster=False, threads=1, peak=True)
    words = [sys.executable, "-c", script, name, str(place), str(grid._CELLS)]
    return float(subprocess.run(words, check=True, capture_output=True, text=True).stdout)


def killed_and_resumed(
    name: str, place: Path, rng: np.random.Generator, clusters: Sequence[bool], **options: float
) -> int:
    """Begin or resume a map once for each of `clusters` (whether by a Dask worker), and kill the process each
    time. Return how often it was still running.
    """
    died = 0
    for cluster in clusters:
        running = process(name, place, cluster=cluster, **options)
        before = tuple((place / "done").rglob("*"))
        deadline = time.monotonic() + 60
        while running.poll() is None and time.monotonic() < deadline:
            if tuple((place / "done").rglob("*")) != before:
                break
            time.sleep(0.005)
        time.sleep(rng.uniform(0, 0.15))
        died += running.poll() is None
        if running.poll() is None:
            os.killpg(running.pid, signal.SIGKILL)
        running.wait()
        assert running.stderr is not None
        running.stderr.close()
    return died


def digest(place: Path) -> str:
    """A hash of the names and bytes of all files of a store."""
    sums = hashlib.sha256()
    for file in sorted(place.rglob("*")):
        if file.is_file():
            sums.update(str(file.relative_to(place)).encode() + b"\0" + file.read_bytes())
    return sums.hexdigest()


def whole(name: str, **options: Any) -> str:
    """The hash of a map computed in one run with the present size of tiles; computed once for all tests."""
    return _whole(name, grid._CELLS, **options)


@functools.cache
def _whole(name: str, cells: int, **options: Any) -> str:
    """The hash of a map computed in one run with tiles of about `cells` cells."""
    with tempfile.TemporaryDirectory() as folder:
        made(name, Path(folder) / "whole.zarr", **options)
        return digest(Path(folder) / "whole.zarr")
