"""Settings of the whole suite: reproducible property tests."""

from __future__ import annotations

import os
from pathlib import Path

# Before numpy: every worker is one thread, and threads of linear algebra that wait keep a processor busy.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hypothesis import HealthCheck, settings
from support import draw
from support.turns import left_out

HERE = Path(__file__).parent
LONGEST = (
    "test_consumer.py", "test_retiming.py", "test_browser.py", "test_docs.py", "test_programs.py",
    "test_joint_motions.py", "test_within_limits.py",
)  # fmt: skip
"""The files that take longest begin first, so that no worker is left with one at the end."""

settings.register_profile(
    "suite",
    deadline=None,  # a shared machine's pauses are no failures
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("suite")


def pytest_report_header() -> str:
    """Say how much the laws draw."""
    return draw.header()


def pytest_configure(config: pytest.Config) -> None:
    """Name the laws that run once for every instruction set, and what `make test` leaves out."""
    config.addinivalue_line("markers", "core: a law that every compiled level must keep")
    config.addinivalue_line("markers", "slow: takes seconds; not in `make test`")
    config.addinivalue_line("markers", "turns(n): one in n of its cases; all of them in `make thorough`")
    if hasattr(config.option, "loadscopereorder"):  # pytest-xdist: those with most tests would begin first
        config.option.loadscopereorder = False
    worker = getattr(config, "workerinput", None)
    if worker and [Path(name).resolve() for name in config.args] == [HERE]:
        # Each worker begins to read elsewhere: what one has compiled in a fresh clone the others find.
        folders = sorted(str(path) for path in HERE.iterdir() if any(path.glob("test_*.py")))
        first = int(worker["workerid"].removeprefix("gw")) * len(folders) // worker["workercount"]
        config.args = folders[first:] + folders[:first]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave cases to `make thorough`, but not what is named, and put the longest files first."""
    other = set() if draw.COUNT or any("[" in name for name in config.args) else left_out(items)
    config.hook.pytest_deselected(items=list(other))
    items[:] = [item for item in items if item not in other]
    place = {name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: (place.get(item.path.name, len(place)), item.path))
