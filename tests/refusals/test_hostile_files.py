"""Files of junk, and places that are no files: one complaint of armangle's own, never another library's."""

from __future__ import annotations

import io
import os
import stat
import tracemalloc
import zipfile
from copy import copy
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import armangle as aa
from armangle.cli import main
from armangle.models.catalogue import ROBOTS, read_robot

ROBOT = ["--robot", "kuka_iiwa7_r800"]
POSES = np.repeat(np.eye(4)[None], 40, axis=0)
Q = np.full((3, 7), 0.1)
MANY = 10**15


def npy(header: str, data: bytes = b"") -> bytes:
    """Return an .npy file with a header of one's own."""
    text = header.encode()
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data


def npz(path: Path, member: bytes, **keywords: int) -> Path:
    """Write an archive whose one member, pose, is these bytes."""
    with zipfile.ZipFile(path, "w", **keywords) as archive:
        archive.writestr("pose.npy", member)
    return path


def bytes_of(array: np.ndarray) -> bytes:
    file = io.BytesIO()
    np.save(file, array, allow_pickle=True)
    return file.getvalue()


# -- JSON ------------------------------------------------------------------------------------------------

JSON = {
    "[" * 200_000: "nested too deeply, wanted an object of named columns",
    '{"pose": ' + "[" * 800 + "]" * 800 + "}": "pose",
    '{"pose": [' + "1" * 5000 + "]}": "holds a whole number that is too long",
    '{"pose": [[' + "1" * 400 + ", 0, 0, 1, 0, 0, 0]]}": "pose holds a whole number that is too large",
    '{"pose": [[0, 0, true, 1, 0, 0, 0]]}': "pose is not an array of numbers but of object",
    '{"pose": [["0", "0", "0", "1", "0", "0", "0"]]}': "pose is not an array of numbers but of <U1",
    '{"pose": [[{}, 0, 0, 1, 0, 0, 0]]}': "pose is not an array of numbers but of object",
    '{"pose": [1, [2]]}': "holds a column whose rows are not of one length: pose",
}


@pytest.mark.parametrize("text", JSON, ids=lambda text: text[:20])
def test_json_of_junk(tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "p.json"
    file.write_text(text)
    with pytest.raises(aa.ModelError, match=f"p\\.json: .*{JSON[text]}"):
        aa.io.load_poses(file)
    assert main(["plan", str(file), *ROBOT]) == 2
    assert "p.json:" in capsys.readouterr().err


# -- NPZ -------------------------------------------------------------------------------------------------

SHAPE = "{'descr': '<f8', 'fortran_order': False, 'shape': (%s, 7), }\n"
MEMBERS = {
    "malformed header": (npy("{'descr': '<f8', 'shape': ((("), "not NPZ: "),
    "no header": (b"", "not NPZ: "),
    "huge shape": (npy(SHAPE % MANY), "not NPZ: "),
    "short data": (npy(SHAPE % 2, bytes(8)), "not NPZ: "),
    "negative shape": (npy(SHAPE % -1, bytes(56)), "not NPZ: "),
    "version 3": (b"\x93NUMPY\x03\x00" + bytes(20), r"has version \(3, 0\), wanted \(1, 0\) or \(2, 0\)"),
    "objects": (bytes_of(np.array([[None]])), "pose.npy holds Python objects, wanted numbers or words"),
    "complex": (bytes_of(np.ones((1, 7), complex)), "pose is not an array of numbers but of complex128"),
    "times": (bytes_of(np.zeros((1, 7), "M8[s]")), r"pose is not an array of numbers but of datetime64\[s\]"),
    "truth": (bytes_of(np.ones((1, 7), bool)), "pose is not an array of numbers but of bool"),
    "words": (bytes_of(np.full((1, 7), "1")), "pose is not an array of numbers but of <U1"),
}


@pytest.mark.parametrize("what", MEMBERS)
def test_npz_of_junk(tmp_path: Path, what: str, capsys: pytest.CaptureFixture[str]) -> None:
    member, message = MEMBERS[what]
    file = npz(tmp_path / "p.npz", member)
    with pytest.raises(aa.ModelError, match=rf"p\.npz: .*{message}"):
        aa.io.load_poses(file)
    assert main(["plan", str(file), *ROBOT]) == 2
    assert "p.npz:" in capsys.readouterr().err


def test_an_npy_file_is_no_npz(tmp_path: Path) -> None:
    (tmp_path / "p.npz").write_bytes(bytes_of(np.eye(7)))
    with pytest.raises(aa.ModelError, match=r"p\.npz: not NPZ: File is not a zip file"):
        aa.io.load_poses(tmp_path / "p.npz")


def test_nothing_is_unpacked_that_the_bytes_cannot_hold(tmp_path: Path) -> None:
    file = npz(tmp_path / "p.npz", bytes_of(np.zeros((100_000, 7))), compression=zipfile.ZIP_BZIP2)
    tracemalloc.start()
    with pytest.raises(aa.ModelError, match=r"pose\.npy is not packed as NPZ is"):
        aa.io.load_poses(file)
    npz(file, npy(SHAPE % MANY))
    with pytest.raises(aa.ModelError, match="not NPZ"):
        aa.io.load_poses(file)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 1_000_000


def test_members_that_lie_over_one_another(tmp_path: Path) -> None:
    file = tmp_path / "p.npz"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("pose.npy", bytes(4000))
        again = copy(archive.filelist[0])
        archive.filelist.append(again)  # twice in the directory, once in the file
    with pytest.raises(aa.ModelError, match="not NPZ: its members are longer than the file"):
        aa.io.load_poses(file)


def test_arrays_in_any_order_of_bytes_are_read(tmp_path: Path) -> None:
    q = np.asfortranarray(np.arange(21).reshape(3, 7))
    for dtype in (">f8", "<f4", ">i2", "u8"):
        np.savez(tmp_path / "q.npz", q=q.astype(dtype), other=np.zeros(2, complex))
        assert np.array_equal(aa.io.load_joints(tmp_path / "q.npz").q, q)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(0, 1, exclude_max=True), st.integers(1, 255), st.sampled_from([".npz", ".json"]))
def test_a_flipped_byte_is_refused_or_does_not_matter(
    tmp_path: Path, at: float, mask: int, ending: str
) -> None:
    good = tmp_path / f"good{ending}"
    if not good.exists():
        aa.io.save(POSES, good)
    data = bytearray(good.read_bytes())
    data[int(at * len(data))] ^= mask
    (tmp_path / f"bad{ending}").write_bytes(data)
    try:
        poses = aa.io.load_poses(tmp_path / f"bad{ending}")
    except aa.ModelError:
        return
    assert poses.shape[1:] == (4, 4) and np.isfinite(poses).all()


# -- joint rows ------------------------------------------------------------------------------------------

HEAD = "status,q1,q2,q3,q4,q5,q6,q7"
ROWS = {
    f"{HEAD}\nOK,nan,0,0,0,0,0,0\n": r":2:2: q1 is nan in a row with status OK",
    f"{HEAD}\nLIMITS,nan,0,0,0,0,0,0\nOK,0,0,0,0,0,0,nan\n": r":3:8: q7 is nan in a row with status OK",
    f"{HEAD},psi\nOK,0,0,0,0,0,0,0,1\nOK,0,0,0,0,0,0,0,nan\n": r":3:9: psi is missing in a row with",
    f"{HEAD},psi\nOK,0,0,0,0,0,0,0,inf\n": r":2:9: psi is inf, wanted an arm angle in rad",
    f"{HEAD},gc\nOK,0,0,0,0,0,0,0,1\n\nOK,0,0,0,0,0,0,0,-1\n": r":4:9: gc is missing in a row with status OK",
    f"{HEAD},s\nOK,0,0,0,0,0,0,0,inf\n": r":2:9: s is inf, wanted a finite number",
    f"{HEAD},s\nOK,0,0,0,0,0,0,0,nan\n": r":2:9: s is nan, wanted a finite number",
}


@pytest.mark.parametrize("text", ROWS)
def test_rows_that_contradict_themselves(tmp_path: Path, text: str) -> None:
    (tmp_path / "j.csv").write_text(text)
    with pytest.raises(aa.ModelError, match=r"j\.csv" + ROWS[text]):
        aa.io.load_joints(tmp_path / "j.csv")


BLOCKS = {
    "q": ({"q": Q * np.nan, "status": np.full(3, "OK")}, r"row 0: q1 is nan in a row with status OK"),
    "psi": (
        {"q": Q, "psi": np.array([0, np.nan, 0]), "status": np.full(3, "OK")},
        r"row 1: psi is missing in a row with status OK, and other rows have it",
    ),
    "s": ({"q": Q, "s": np.array([0, 1, np.inf])}, r"row 2: s is inf, wanted a finite number"),
    "complex": ({"q": Q + 1j}, r"q is not an array of numbers but of complex128"),
    "status": ({"q": Q, "status": np.arange(3)}, r"status is not a row of words but of int64, shape \(3,\)"),
    "no text": (
        {"q": Q, "status": np.frombuffer(b"\xff" * 12, "<U1")},
        r"status is not a row of words: ",
    ),
}


@pytest.mark.parametrize("what", BLOCKS)
def test_blocks_that_contradict_themselves(tmp_path: Path, what: str) -> None:
    blocks, message = BLOCKS[what]
    np.savez(tmp_path / "j.npz", **blocks)
    with pytest.raises(aa.ModelError, match=rf"j\.npz: {message}"):
        aa.io.load_joints(tmp_path / "j.npz")


@pytest.mark.parametrize("ending", [".csv", ".npz", ".json"])
def test_a_table_that_knows_no_arm_angle_comes_back(tmp_path: Path, ending: str) -> None:
    (tmp_path / "j.csv").write_text("q1,q2,q3,q4,q5,q6,q7\n0,0,0,0,0,0,0\nnan,0,0,0,0,0,0\n")
    table = aa.io.load_joints(tmp_path / "j.csv")
    aa.io.save(table, tmp_path / f"again{ending}")
    again = aa.io.load_joints(tmp_path / f"again{ending}")
    for name in ("s", "q", "psi", "gc", "status", "margin"):
        assert np.array_equal(getattr(again, name), getattr(table, name), equal_nan=True)


# -- TOML ------------------------------------------------------------------------------------------------

GOOD = (ROBOTS / "kuka_iiwa7_r800.toml").read_text()
TOML = {
    "x = " + "[" * 5000: "nested too deeply, wanted plain keys",
    "x = " + "1" * 5000: "holds a whole number that is too long",
    GOOD.replace("signs = [1,", f"signs = [0x{'f' * 8000},"): "holds a whole number that is too long",
    "a." * 20_000 + "a = 1": "holds a dotted key of more than 16 parts",
}


@pytest.mark.parametrize("text", TOML, ids=lambda text: text[-20:])
def test_toml_of_junk(tmp_path: Path, text: str, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "r.toml"
    file.write_text(text)
    with pytest.raises(aa.ModelError, match=rf"r\.toml: {TOML[text]}"):
        read_robot(file)
    assert main(["inspect", str(file), "--joints", ",".join("0" * 7)]) == 2
    assert "r.toml:" in capsys.readouterr().err


# -- places ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", [".csv", ".npz", ".json"])
def test_a_name_that_no_file_can_have(ending: str) -> None:
    name = f"a\0b{ending}"
    for load in (aa.io.load_joints, aa.io.load_poses):
        with pytest.raises(aa.ModelError, match=r"'a\\x00b\.\w+': cannot be read: embedded null"):
            load(name)
    with pytest.raises(aa.OutputError, match=r"'a\\x00b\.\w+': cannot be written: "):
        aa.io.save(POSES, name)
    with pytest.raises(aa.ModelError, match=r"'a\\x00b\.toml': cannot be read: embedded null"):
        read_robot("a\0b.toml")


def test_a_pipe_is_not_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "link.csv").symlink_to("pipe.csv")
    for name in ("pipe.csv", "link.csv"):
        with pytest.raises(aa.OutputError, match=rf"{name}: cannot be written: it is a pipe or a device"):
            aa.io.save(POSES, tmp_path / name)
    assert stat.S_ISFIFO((tmp_path / "pipe.csv").stat().st_mode)
    assert len(list(tmp_path.iterdir())) == 2


def test_a_device_is_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    link = tmp_path / "x.csv"
    link.symlink_to(os.devnull)
    before = Path(os.devnull).stat()
    assert main(["inspect", ROBOT[1], "--joints", ",".join("0" * 7), "-o", str(link)]) == 2
    assert "it is a pipe or a device, wanted a regular file" in " ".join(capsys.readouterr().err.split())
    after = Path(os.devnull).stat()
    assert (after.st_ino, after.st_mode, after.st_rdev) == (before.st_ino, before.st_mode, before.st_rdev)


def test_a_read_only_file_is_not_replaced(tmp_path: Path) -> None:
    file = tmp_path / "p.csv"
    file.write_text("old")
    file.chmod(0o444)
    with pytest.raises(aa.OutputError, match=r"p\.csv: cannot be written: it is read-only"):
        aa.io.save(POSES, file)
    assert file.read_text() == "old" and list(tmp_path.iterdir()) == [file]
