"""Settings of the whole suite: reproducible property tests."""

from __future__ import annotations

import os

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "suite",
    deadline=None,  # a shared machine's pauses are no failures
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("long", settings.get_profile("suite"), derandomize=False, max_examples=5000)
settings.load_profile(os.environ.get("ARMANGLE_LAWS", "suite"))


def pytest_configure(config: pytest.Config) -> None:
    """Name the compact part of the laws that runs once for every instruction set."""
    config.addinivalue_line("markers", "core: a law that every compiled level must keep")
