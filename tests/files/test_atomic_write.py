"""A run that is killed while it writes leaves the old file, or none: never half of one."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
ROWS = 400
WRITER = """
import sys
import numpy as np
import armangle as aa
poses = np.repeat(np.eye(4)[None], int(sys.argv[2]), axis=0)
print("ready", flush=True)
k = 0
while True:
    k += 1
    poses[:, 0, 3] = k
    aa.io.save(poses, sys.argv[1])
"""


def start(path: Path) -> subprocess.Popen[bytes]:
    """Start a process that writes the file again and again, all rows of one write holding one number."""
    process = subprocess.Popen([sys.executable, "-c", WRITER, str(path), str(ROWS)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    assert process.stdout.readline() == b"ready\n"
    return process


def is_whole(path: Path) -> bool:
    """Whether the file holds all rows of one write."""
    if path.suffix == ".csv":
        numbers = aa.io.load_poses(path)[:, 0, 3]
    elif path.suffix == ".npz":
        numbers = np.load(path)["pose"][:, 0]
    else:
        numbers = np.array(json.loads(path.read_text())["pose"])[:, 0]
    return len(numbers) == ROWS and bool((numbers == numbers[0]).all())


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["csv", "npz", "json"])
def test_kill_9_at_any_time_leaves_a_whole_file_or_none(ending: str, tmp_path: Path) -> None:
    """`save`, killed at a random time, leaves a whole file or none, and can write it again."""
    path = tmp_path / f"out.{ending}"
    for delay in np.random.default_rng(3).uniform(0.0, 0.05, 8):
        process = start(path)
        time.sleep(float(delay))
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert process.stdout is not None
        process.stdout.close()
        assert not path.exists() or is_whole(path)
    aa.io.save(np.repeat(np.eye(4)[None], ROWS, axis=0), path)  # what was left behind is in nobody's way
    assert is_whole(path)


def test_writers_of_one_file_at_once_leave_one_of_their_files(tmp_path: Path) -> None:
    """`save` of one file by eight threads leaves one of their files whole, and no other."""
    path = tmp_path / "out.csv"

    def write(k: int) -> None:
        poses = np.repeat(np.eye(4)[None], ROWS, axis=0)
        poses[:, 0, 3] = k
        aa.io.save(poses, path)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, range(40)))
    assert is_whole(path)
    assert [p.name for p in tmp_path.iterdir()] == ["out.csv"]
