"""Files of junk, tables with faults, and places that are no files: one complaint of armangle's own.

Of a file: its name, line and column, what is there; never another library's error.
"""

from __future__ import annotations

import io
import json
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
from support.refused import not_refused

import armangle as aa
from armangle.cli import main
from armangle.models.catalogue import ROBOTS, read_robot

ROBOT = ["--robot", "kuka_iiwa7_r800"]
ENDINGS = (".csv", ".npz", ".json")
POSES = np.repeat(np.eye(4)[None], 40, axis=0)
Q = np.full((3, 7), 0.1)
MANY = 10**15
HEADER = "x,y,z,qw,qx,qy,qz\n"
GOOD = "0.1,0.2,0.3,1,0,0,0\n"


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
    """An array as the bytes of an .npy file."""
    file = io.BytesIO()
    np.save(file, array, allow_pickle=True)
    return file.getvalue()


POSES_CSV = {
    "": ":1: empty", "x,y,z,qw,qx,qy,q_z\n": ":1: missing column qz.*: rename 'q_z' to 'qz'",
    "x,y,z,w,qx,qy,qz\n": ":1: missing column qw; .*: rename 'w' to 'qw'",
    "a,b\n": ":1: missing column x, y, z, qw, qx, qy, qz; the header has 'a', 'b'$",
    "x;y;z;qw;qx;qy;qz\n": ":1: missing .*semicolons",
    "x,x,y,z,qw,qx,qy,qz\n": ":1: column x is there 2 times",
    HEADER + GOOD + "0,0,oops,1,0,0,0\n": ":3:3: z is 'oops'",
    HEADER + GOOD + "0,0,,1,0,0,0\n": ":3:3: z is empty",
    HEADER + GOOD + "0,0,1_0,1,0,0,0\n": ":3:3: z is '1_0'",
    HEADER + GOOD + "\n0,nan,0,1,0,0,0\n": ":4:2: y is nan",
    HEADER + "inf,0,0,1,0,0,0\n": ":2:1: x is inf",
    HEADER + GOOD + "0,0,0,1,1,0,0\n": r":3:4: the quaternion has length 1\.41421356, wanted 1",
    HEADER + "0,0,0,0,0,0,0\n": ":2:4: the quaternion has length 0",
    HEADER + "0,0,0,1.0000011,0,0,0\n": r":2:4: the quaternion has length 1\.0000011",
    HEADER + "0,0,0,0.707,0.707,0,0\n": r":2:4: .* length 0\.99984.*divide",
    HEADER + "0,0,0,1\n": ":2: 4 fields, wanted 7", HEADER + '0,0,0,1,0,0,"0\n': ":2: not CSV",
    HEADER + GOOD * 20000 + "0,0,0,1,0,x,0\n" + GOOD: ":20002:6: qy is 'x'",
    b"\xff\xfe\x00": ": not UTF-8 text",
}  # fmt: skip
POSES_JSON: dict[str | bytes, str] = {
    "{\n 3}": ":2:2: not JSON: ", b"\xff": ": not UTF-8 text", "[1]": ": holds a list, wanted an object",
    '{"a": 1}': ": missing 'pose'; the file has 'a'",
    '{"pose": [[1, 2], [3]]}': ": .* not of one length", '{"pose": [1, [2]]}': ": .* not of one length: pose",
    '{"pose": [[1, 2]]}': r": pose has shape \(1, 2\), wanted numbers of shape \(N, 7\)",
    '{"pose": [["a"]]}': ": pose is not an array of numbers",
    '{"pose": [[0,0,0,1,1,0,0]]}': r": pose\[0\]: the quaternion has length 1\.414",
    "[" * 200_000: ": nested too deeply", '{"pose": ' + "[" * 800 + "]" * 800 + "}": ": .*pose",
    '{"pose": [' + "1" * 5000 + "]}": ": holds a whole number that is too long",
    '{"pose": [[' + "1" * 400 + ", 0, 0, 1, 0, 0, 0]]}": ": pose holds a whole number that is too large",
    '{"pose": [[0, 0, true, 1, 0, 0, 0]]}': ": pose is not an array of numbers but of object",
    '{"pose": [["0", "0", "0", "1", "0", "0", "0"]]}': ": pose is not an array of numbers but of <U1",
    '{"pose": [[{}, 0, 0, 1, 0, 0, 0]]}': ": pose is not an array of numbers but of object",
}  # fmt: skip
SHAPE = "{'descr': '<f8', 'fortran_order': False, 'shape': (%s, 7), }\n"
NUMBERS = "pose is not an array of numbers but of"
POSES_NPZ: list[tuple[bytes, str]] = [
    *((member, "not NPZ: ") for member in (
        npy("{'descr': '<f8', 'shape': ((("), b"", npy(SHAPE % MANY), npy(SHAPE % 2, bytes(8)),
        npy(SHAPE % -1, bytes(56)))),
    (b"\x93NUMPY\x03\x00" + bytes(20), r"has version \(3, 0\)"),
    (bytes_of(np.array([[None]])), "pose.npy holds Python objects"),
    (bytes_of(np.ones((1, 7), complex)), f"{NUMBERS} complex128"),
    (bytes_of(np.zeros((1, 7), "M8[s]")), rf"{NUMBERS} datetime64\[s\]"),
    (bytes_of(np.ones((1, 7), bool)), f"{NUMBERS} bool"), (bytes_of(np.full((1, 7), "1")), f"{NUMBERS} <U1"),
]  # fmt: skip


def files_of(folder: Path) -> list[tuple[Path, str]]:
    """Write every bad file of poses; return each with the pattern of its message."""
    out = []
    for ending, rows in ((".csv", POSES_CSV), (".json", POSES_JSON)):
        for k, (content, pattern) in enumerate(rows.items()):
            out.append((folder / f"p{k}{ending}", pattern))
            out[-1][0].write_bytes(content if isinstance(content, bytes) else content.encode())
    for k, (member, pattern) in enumerate(POSES_NPZ):
        out.append((npz(folder / f"p{k}.npz", member), f": .*{pattern}"))
    for name, content in (("none.npz", b"no zip"), ("npy.npz", bytes_of(np.eye(7)))):
        out.append((folder / name, ": not NPZ"))
        out[-1][0].write_bytes(content)
    return out


def test_what_is_wrong_with_files_of_poses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`load_poses` refuses faulty files with line and column; so does the command line."""
    files = files_of(tmp_path)
    assert not_refused(
        (aa.ModelError, rf"{file.name}{pattern}", lambda file=file: aa.io.load_poses(file))
        for file, pattern in files
    ) == []  # fmt: skip
    for file, _ in files[-20:]:  # of the last of JSON and all of NPZ, what the command line makes of them
        assert main(["plan", str(file), *ROBOT]) == 2
        assert f"{file.name}:" in capsys.readouterr().err
    with pytest.raises(aa.ModelError) as caught:
        aa.io.load_poses(tmp_path / "p17.csv")
    assert (caught.value.line, caught.value.column) == (20002, 6)


J = "q1,q2,q3,q4,q5,q6,q7"
OK = f"status,{J}"
JOINTS_CSV = {
    f"{J}\n0,0,0,0,0,0,inf\n": ":2:7: q7 is inf", f"{J},gc\n0,0,0,0,0,0,0,8\n": ":2:8: gc is 8, .* 0 to 7",
    f"gc,{J}\n0.5,0,0,0,0,0,0,0\n": r":2:1: gc is 0\.5",
    f"{J},status\n0,0,0,0,0,0,0,FINE\n": ":2:8: status is 'FINE'",
    "q1,q2\n": ":1: missing column q3, q4, q5, q6, q7; the header has 'q1', 'q2'",
    f"{OK}\nOK,nan,0,0,0,0,0,0\n": ":2:2: q1 is nan",
    f"{OK}\nLIMITS,nan,0,0,0,0,0,0\nOK,0,0,0,0,0,0,nan\n": ":3:8: q7 is nan",
    f"{OK},psi\nOK,0,0,0,0,0,0,0,1\nOK,0,0,0,0,0,0,0,nan\n": ":3:9: psi is missing",
    f"{OK},psi\nOK,0,0,0,0,0,0,0,inf\n": ":2:9: psi is inf",
    f"{OK},gc\nOK,0,0,0,0,0,0,0,1\n\nOK,0,0,0,0,0,0,0,-1\n": ":4:9: gc is missing",
    f"{OK},s\nOK,0,0,0,0,0,0,0,inf\n": ":2:9: s is inf", f"{OK},s\nOK,0,0,0,0,0,0,0,nan\n": ":2:9: s is nan",
}  # fmt: skip
BLOCKS = [
    ({"q": Q * np.nan, "status": np.full(3, "OK")}, "row 0: q1 is nan"),
    ({"q": Q, "psi": np.array([0, np.nan, 0]), "status": np.full(3, "OK")}, "row 1: psi is missing"),
    ({"q": Q, "s": np.array([0, 1, np.inf])}, "row 2: s is inf"), ({"q": Q + 1j}, "q is not .* complex128"),
    ({"q": Q, "status": np.arange(3)}, r"status is not a row of words but of int64, shape \(3,\)"),
    ({"q": Q, "status": np.frombuffer(b"\xff" * 12, "<U1")}, "status is not a row of words: "),
    ({"q": Q, "psi": np.zeros(2)}, "psi has 2 rows and q has 3"),
    ({"q": Q, "status": ["BAD"] * 3}, "status is 'BAD'"),
]  # fmt: skip


def test_what_is_wrong_with_files_of_joints(tmp_path: Path) -> None:
    """`load_joints` refuses faulty files with their places."""
    files = []
    for k, (text, pattern) in enumerate(JOINTS_CSV.items()):
        files.append((tmp_path / f"j{k}.csv", pattern))
        files[-1][0].write_text(text)
    for k, (blocks, pattern) in enumerate(BLOCKS):
        files.append((tmp_path / f"j{k}.npz", f": .*{pattern}"))
        np.savez(files[-1][0], **blocks)
    files.append((tmp_path / "j.json", ": psi has 2 rows and q has 1"))
    files[-1][0].write_text(json.dumps({"q": [[0] * 7], "psi": [0, 0]}))
    assert not_refused(
        (aa.ModelError, rf"{file.name}{pattern}", lambda file=file: aa.io.load_joints(file))
        for file, pattern in files
    ) == []  # fmt: skip


TOML_GOOD = (ROBOTS / "kuka_iiwa7_r800.toml").read_text()
TOML = {
    "x = " + "[" * 5000: "nested too deeply", "x = " + "1" * 5000: "holds a whole number that is too long",
    TOML_GOOD.replace("signs = [1,", f"signs = [0x{'f' * 8000},"): "holds a whole number that is too long",
    "a." * 20_000 + "a = 1": "holds a dotted key of more than 16 parts",
    TOML_GOOD.replace("d_bs = 0.34", "d_bs = 1" + "0" * 400): "d_bs has 1000",
}  # fmt: skip


def test_toml_of_junk(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`read_robot` and the command line, which returns 2, refuse hostile TOML with the file's name."""
    file = tmp_path / "r.toml"
    for text, message in TOML.items():
        file.write_text(text)
        with pytest.raises(aa.ModelError, match=rf"r\.toml:.*{message}"):
            read_robot(file)
        assert main(["inspect", str(file), "--joints", ",".join("0" * 7)]) == 2
        assert "r.toml:" in capsys.readouterr().err


def test_nothing_is_unpacked_that_the_bytes_cannot_hold(tmp_path: Path) -> None:
    """`load_poses` refuses other compression and huge shapes, and takes less than 1 MB for it."""
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
    """`load_poses` refuses an archive whose members are longer than its file."""
    file = tmp_path / "p.npz"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("pose.npy", bytes(4000))
        again = copy(archive.filelist[0])
        archive.filelist.append(again)  # twice in the directory, once in the file
    with pytest.raises(aa.ModelError, match="not NPZ: its members are longer than the file"):
        aa.io.load_poses(file)


def test_arrays_in_any_order_of_bytes_are_read(tmp_path: Path) -> None:
    """`load_joints` reads arrays of any byte order, number type and memory order."""
    q = np.asfortranarray(np.arange(21).reshape(3, 7))
    for dtype in (">f8", "<f4", ">i2", "u8"):
        np.savez(tmp_path / "q.npz", q=q.astype(dtype), other=np.zeros(2, complex))
        assert np.array_equal(aa.io.load_joints(tmp_path / "q.npz").q, q)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.floats(0, 1, exclude_max=True), st.integers(1, 255), st.sampled_from([".npz", ".json"]))
def test_a_flipped_byte_is_refused_or_does_not_matter(
    tmp_path: Path, at: float, mask: int, ending: str
) -> None:
    """`load_poses` of a file with one byte changed raises ModelError or gives finite poses."""
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


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_table_that_knows_no_arm_angle_comes_back(tmp_path: Path, ending: str) -> None:
    """`save` and `load_joints` keep a table without psi and gc."""
    (tmp_path / "j.csv").write_text("q1,q2,q3,q4,q5,q6,q7\n0,0,0,0,0,0,0\nnan,0,0,0,0,0,0\n")
    table = aa.io.load_joints(tmp_path / "j.csv")
    aa.io.save(table, tmp_path / f"again{ending}")
    again = aa.io.load_joints(tmp_path / f"again{ending}")
    for name in ("s", "q", "psi", "gc", "status", "margin"):
        assert np.array_equal(getattr(again, name), getattr(table, name), equal_nan=True)


# -- places ------------------------------------------------------------------------------------


@pytest.mark.parametrize("ending", ENDINGS)
def test_a_place_where_no_file_can_be_is_named(tmp_path: Path, ending: str) -> None:
    """Readers and `save` refuse a name with a null byte, missing files and folders."""
    name, folder = f"a\0b{ending}", tmp_path / f"d{ending}"
    folder.mkdir()
    null = r"^'a\\x00b\.\w+': cannot be read: embedded null"
    assert not_refused(
        (aa.ModelError, pattern, lambda load=load, place=place: load(place))
        for load in (aa.io.load_joints, aa.io.load_poses)
        for place, pattern in ((name, null), (tmp_path / f"absent{ending}", "no such file"),
                               (folder, "cannot be read: a folder"))
    ) == []  # fmt: skip
    with pytest.raises(aa.OutputError, match=r"'a\\x00b\.\w+': cannot be written: "):
        aa.io.save(POSES, name)
    with pytest.raises(aa.ModelError, match=r"'a\\x00b\.toml': cannot be read: embedded null"):
        read_robot("a\0b.toml")
    with pytest.raises(aa.ModelError, match="cannot be read"):
        aa.Arm.from_urdf("a\0b")


def test_a_pipe_is_not_replaced(tmp_path: Path) -> None:
    """`save` refuses a pipe, also behind a link, and leaves it."""
    os.mkfifo(tmp_path / "pipe.csv")
    (tmp_path / "link.csv").symlink_to("pipe.csv")
    for name in ("pipe.csv", "link.csv"):
        with pytest.raises(aa.OutputError, match=rf"{name}: cannot be written: it is a pipe or a device"):
            aa.io.save(POSES, tmp_path / name)
    assert stat.S_ISFIFO((tmp_path / "pipe.csv").stat().st_mode)
    assert len(list(tmp_path.iterdir())) == 2


def test_a_device_is_not_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The command line refuses to write to a device, and leaves it."""
    link = tmp_path / "x.csv"
    link.symlink_to(os.devnull)
    before = Path(os.devnull).stat()
    assert main(["inspect", ROBOT[1], "--joints", ",".join("0" * 7), "-o", str(link)]) == 2
    assert "it is a pipe or a device, wanted a regular file" in " ".join(capsys.readouterr().err.split())
    after = Path(os.devnull).stat()
    assert (after.st_ino, after.st_mode, after.st_rdev) == (before.st_ino, before.st_mode, before.st_rdev)


def test_a_read_only_file_is_not_replaced(tmp_path: Path) -> None:
    """`save` refuses a read-only file, and leaves it."""
    file = tmp_path / "p.csv"
    file.write_text("old")
    file.chmod(0o444)
    with pytest.raises(aa.OutputError, match=r"p\.csv: cannot be written: it is read-only"):
        aa.io.save(POSES, file)
    assert file.read_text() == "old" and list(tmp_path.iterdir()) == [file]
