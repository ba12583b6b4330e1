"""What the figures were measured on, in words."""

from __future__ import annotations

import datetime
import os
import platform
import subprocess
from pathlib import Path


def cpu_model() -> str:
    """Return the processor's own name."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or platform.machine()
    found = {key.strip(): value.strip() for key, _, value in (line.partition(":") for line in lines)}
    model = found.get("model name") or platform.machine()
    if "cpu family" in found:
        model += f" (family {found['cpu family']}, model {found['model']})"
    return model


def compiler() -> str:
    """Return the first line of the C++ compiler's version, or that there is none."""
    try:
        answer = subprocess.run(
            [os.environ.get("CXX", "g++"), "--version"], capture_output=True, text=True, check=True
        )
    except (OSError, subprocess.CalledProcessError):
        return "no C++ compiler"
    return answer.stdout.splitlines()[0]


def describe() -> str:
    """Return one sentence: processor, cores, system, versions, date, load."""
    date = datetime.datetime.now(datetime.UTC).date().isoformat()
    load = ", ".join(f"{x:.2f}" for x in os.getloadavg())
    return (
        f"{cpu_model()}, {os.cpu_count()} cores, {platform.system()} {platform.machine()}, "
        f"Python {platform.python_version()},\n{compiler()}, {date}, load average {load}"
    )
