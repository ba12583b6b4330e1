"""Files come back as they were, are whole or absent, and say where they are wrong."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.refused import Row, not_refused

import armangle as aa
from armangle.files.replacing import replacing
from armangle.poses import poses_from_rows, rows_from_poses

ENDINGS = (".csv", ".npz", ".json")
HEADER = "x,y,z,qw,qx,qy,qz\n"
START = np.radians([-5.4101, -26.4986, -48.1542, -61.65, 152.6198, 114.4466, 8.1812])


def names(folder: Path) -> list[str]:
    """The names of all files in a folder."""
    return [path.name for path in folder.iterdir()]


def random_poses(n: int, seed: int = 1) -> np.ndarray:
    """Return n random poses (n, 4, 4)."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(n, 7))
    rows[:, 3:] /= np.linalg.norm(rows[:, 3:], axis=1, keepdims=True)
    return poses_from_rows(rows)


@pytest.fixture
def path() -> aa.JointPath:
    """A motion of 40 rows that stops half way: the rows after are NaN."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    pose = arm.forward(START)[0]
    poses = np.repeat(pose[None], 40, axis=0)
    poses[:, :3, 3] += np.linspace(0, 1.5, 40)[:, None] * pose[:3, 2]
    return aa.follow(arm, poses, start=START)


# -- quaternions ---------------------------------------------------------------------------------------


def test_quaternions_are_rotations_and_come_back() -> None:
    """`poses_from_rows` gives rotations, and `rows_from_poses` the same rows with qw >= 0."""
    poses = random_poses(2000)
    r = poses[:, :3, :3]
    assert np.abs(r @ r.transpose(0, 2, 1) - np.eye(3)).max() < 4e-16 * 4
    assert np.linalg.det(r) == pytest.approx(1)
    rows = rows_from_poses(poses)
    assert (rows[:, 3] >= 0).all()
    assert np.abs(poses_from_rows(rows) - poses).max() < 2e-15


def test_half_turns_keep_their_digits() -> None:
    """Rotations by half a turn, or nearly, come back from quaternions within 1e-15."""
    axes = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0.8, 0], [0, -0.6, 0.8], [-0.48, 0.6, 0.64]])
    for short in (0.0, 1e-15, 1e-9, 1e-4):
        half = (np.pi - short) / 2
        rows = np.hstack([np.zeros((6, 3)), np.full((6, 1), np.cos(half)), np.sin(half) * axes])
        pose = poses_from_rows(rows)
        assert np.abs(poses_from_rows(rows_from_poses(pose)) - pose).max() < 1e-15


# -- there and back --------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("n", [0, 1, 10000])
def test_poses_come_back(tmp_path: Path, ending: str, n: int) -> None:
    """`load_poses` reads what `save` wrote, positions to the bit."""
    poses = random_poses(n)
    aa.io.save(poses, tmp_path / f"p{ending}")
    back = aa.io.load_poses(tmp_path / f"p{ending}")
    assert back.shape == (n, 4, 4)
    assert np.abs(back - poses).max(initial=0) < 4e-15
    assert np.array_equal(back[:, :3, 3], poses[:, :3, 3])


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_motion_comes_back_bit_for_bit(tmp_path: Path, ending: str, path: aa.JointPath) -> None:
    """`load_joints` reads what `save` wrote of a motion to the bit, and saving that gives an equal file."""
    assert not path.ok and path.first_failure
    aa.io.save(path, tmp_path / f"m{ending}")
    back = aa.io.load_joints(tmp_path / f"m{ending}")
    for name in ("s", "q", "psi", "gc", "status", "margin"):
        mine, theirs = getattr(path, name), getattr(back, name)
        assert mine.dtype == theirs.dtype and np.array_equal(mine, theirs, equal_nan=True), name
    aa.io.save(back, tmp_path / f"again{ending}")
    if ending != ".npz":
        assert (tmp_path / f"again{ending}").read_bytes() == (tmp_path / f"m{ending}").read_bytes()
    assert repr(back) == "<JointTable of 40 rows>" and len(back) == 40


@pytest.mark.parametrize("ending", ENDINGS)
def test_an_empty_motion_and_infinite_margins_come_back(tmp_path: Path, ending: str) -> None:
    """`load_joints` reads motions of no rows, and of an arm without limits."""
    arm = aa.Arm(d_bs=0.34, d_se=0.4, d_ew=0.4, d_wf=0.126)
    for n in (0, 3):
        poses = np.repeat(arm.forward(START)[0][None], n, axis=0)
        aa.io.save(aa.follow(arm, poses, start=START), tmp_path / f"m{ending}")
        back = aa.io.load_joints(tmp_path / f"m{ending}")
        assert back.q.shape == (n, 7) and np.array_equal(back.margin, np.full(n, np.inf))


def test_joint_columns_are_as_documented(tmp_path: Path, path: aa.JointPath) -> None:
    """`save` writes the documented columns, and null or nan where there are no joints."""
    aa.io.save(path, tmp_path / "m.csv")
    lines = (tmp_path / "m.csv").read_text().splitlines()
    assert lines[0] == "s,q1,q2,q3,q4,q5,q6,q7,psi,gc,status,margin"
    assert len(lines) == 41 and lines[1].split(",")[10] == "OK"
    assert lines[-1].endswith("nan,-1,NOT_REACHED,nan")
    aa.io.save(path, tmp_path / "m.json")
    table = json.loads((tmp_path / "m.json").read_text())
    assert table["kind"] == "joints" and table["q"][-1] == [None] * 7


def test_joints_alone_are_a_joint_file(tmp_path: Path) -> None:
    """`load_joints` reads a file of q1..q7 alone: gc is -1, psi NaN, a row with NaN NOT_REACHED."""
    (tmp_path / "j.csv").write_text("q7,q6,q5,q4,q3,q2,q1,note\n7,6,5,4,3,2,1,a\nnan,6,5,4,3,2,1,b\n")
    back = aa.io.load_joints(tmp_path / "j.csv")
    assert back.q[0].tolist() == [1, 2, 3, 4, 5, 6, 7]
    assert back.s.tolist() == [0, 1] and back.gc.tolist() == [-1, -1]
    assert back.status.tolist() == [aa.Status.OK, aa.Status.NOT_REACHED] and np.isnan(back.psi).all()


def test_columns_in_any_order_with_others_between(tmp_path: Path) -> None:
    """`load_poses` takes columns in any order, other columns, a byte order mark and empty lines."""
    text = '\ufefft, qz,qy,note,qx,qw,z,y,x\r\n\r\n0,0,0,"a, b",0,1,3,2,1\r\n'
    (tmp_path / "p.csv").write_text(text, encoding="utf-8", newline="")
    pose = aa.io.load_poses(tmp_path / "p.csv")
    assert pose[0, :3, 3].tolist() == [1, 2, 3] and np.array_equal(pose[0, :3, :3], np.eye(3))


def test_one_pose_is_a_row_and_a_quaternion_of_six_digits_is_made_unit(tmp_path: Path) -> None:
    """`save` takes a single pose; `load_poses` makes a rounded quaternion unit."""
    file = tmp_path / "p.csv"
    aa.io.save(np.eye(4), file)
    assert file.read_text() == HEADER + "0.0,0.0,0.0,1.0,0.0,0.0,0.0\n"
    file.write_text(HEADER + "0,0,0,0.707107,0.707107,0,0\n")
    r = aa.io.load_poses(file)[0, :3, :3]
    assert np.abs(r @ r.T - np.eye(3)).max() < 1e-15


@pytest.mark.parametrize("ending", ENDINGS)
def test_solutions_are_saved_as_joint_rows(ending: str, tmp_path: Path) -> None:
    """`save` takes a Solution, a batch or Solutions, and `load_joints` reads their q and gc."""
    arm, file = aa.Arm.from_catalogue("kuka_iiwa7_r800"), tmp_path / f"joints{ending}"
    pose = arm.forward(START)[0]
    far = pose + 3 * np.eye(4, k=3)
    for value in (arm.solve(pose, seed=START), arm.solve(np.stack([pose, far])), arm.solutions(pose)):
        aa.io.save(value, file)
        rows = aa.io.load_joints(file)
        assert np.array_equal(rows.q, np.reshape(value.q, (-1, 7)), equal_nan=True)
        assert np.array_equal(rows.gc, np.ravel(value.gc))


@pytest.mark.slow
def test_reading_holds_little_more_than_the_result(tmp_path: Path) -> None:
    """`load_poses` needs little more memory than its result."""
    n = 60_000
    with (tmp_path / "p.csv").open("w") as file:
        file.write(HEADER)
        file.writelines(f"{i / n!r},0.123456789012,0.3,1.0,0.0,0.0,0.0\n" for i in range(n))
    tracemalloc.start()
    poses = aa.io.load_poses(tmp_path / "p.csv")
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    rows, block = n * 7 * 8, 8192 * 7 * 200
    assert poses.nbytes == n * 16 * 8
    assert peak < poses.nbytes + rows + 2 * block


# -- whole or absent -------------------------------------------------------------------------------------


def test_a_failure_while_writing_leaves_the_old_file(tmp_path: Path) -> None:
    """`replacing` leaves the old file, and no other, if writing is interrupted."""
    target = tmp_path / "p.csv"
    target.write_text("old")

    def interrupted() -> None:
        with replacing(target) as file:
            file.write(b"new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert target.read_text() == "old" and names(tmp_path) == ["p.csv"]


def test_a_killed_run_leaves_the_old_file(tmp_path: Path) -> None:
    """`replacing` leaves the old file if the process is killed."""
    target = tmp_path / "p.csv"
    target.write_text("old")
    code = (
        "import os, signal, sys\n"
        "from armangle.files.replacing import replacing\n"
        "with replacing(sys.argv[1]) as file:\n"
        "    file.write(b'new' * 100000)\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    assert subprocess.run([sys.executable, "-c", code, str(target)]).returncode == -9
    assert target.read_text() == "old"


def test_a_full_disk_is_an_output_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`save` on a full disk raises OutputError and leaves no file."""

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(aa.OutputError, match=r"p\.csv: cannot be written: No space left on device"):
        aa.io.save(np.eye(4), tmp_path / "p.csv")
    assert names(tmp_path) == []


def test_a_link_is_written_through_and_the_mode_kept(tmp_path: Path) -> None:
    """`save` to a symbolic link writes the file behind it and keeps its mode."""
    (tmp_path / "real.csv").write_text("old")
    (tmp_path / "real.csv").chmod(0o640)
    (tmp_path / "link.csv").symlink_to("real.csv")
    aa.io.save(np.eye(4), tmp_path / "link.csv")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "real.csv").read_text().startswith("x,y,z")
    assert (tmp_path / "real.csv").stat().st_mode & 0o777 == 0o640


UNSAVED: list[tuple[Any, str, str]] = [
    (np.eye(4), "p.txt", r"'\.txt' is not known"), (np.eye(4), "p", "'' is not known"),
    (3.0, "p.csv", "a float"),
    (START, "p.csv", "joints or poses"), (np.eye(3), "p.csv", r"shape \(3, 3\), wanted \(\.\.\., 4, 4\)"),
    (np.zeros((2, 2, 4, 4)), "p.csv", r"shape \(2, 2, 4, 4\)"),
    (np.full((4, 4), np.nan), "p.csv", r"pose\[0\] holds nan"),
    ([np.eye(4), 2 * np.eye(4)], "p.csv", r"pose\[1\]"),
    (np.diag([1.0, 1, -1, 1]), "p.csv", r"pose\[0\] is a reflection"),
]  # fmt: skip


def test_what_cannot_be_saved_and_where(tmp_path: Path) -> None:
    """`save` refuses other values, endings and places, and writes nothing."""
    rows: list[Row] = [
        (aa.InputError, pattern, lambda value=value, name=name: aa.io.save(value, tmp_path / name))
        for value, name, pattern in UNSAVED
    ]
    assert not_refused(rows) == [] and names(tmp_path) == []
    (tmp_path / "d.csv").mkdir()
    (tmp_path / "f").write_text("")
    places = (("no/p.csv", "No such file"), ("d.csv", "it is a folder"), ("f/p.csv", "Not a directory"))
    assert not_refused(
        (aa.OutputError, f"{place}: cannot be written: {why}",
         lambda place=place: aa.io.save(np.eye(4), tmp_path / place))
        for place, why in places
    ) == []  # fmt: skip
