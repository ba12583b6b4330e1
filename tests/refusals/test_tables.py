"""Every complaint about a file of poses or joints: file, line, column, what is there, what was wanted."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import armangle as aa

ENDINGS = (".csv", ".npz", ".json")
HEADER = "x,y,z,qw,qx,qy,qz\n"
GOOD = "0.1,0.2,0.3,1,0,0,0\n"

BAD_POSES = {
    "": r":1: empty, wanted a header with x,y,z,qw,qx,qy,qz",
    "x,y,z,qw,qx,qy,q_z\n": r":1: missing column qz.*; column 'q_z' may be .* 'qz': rename 'q_z' to 'qz'",
    "x,y,z,w,qx,qy,qz\n": r":1: missing column qw; .*; column 'w' may be meant for 'qw': rename 'w' to 'qw'",
    "a,b\n": r":1: missing column x, y, z, qw, qx, qy, qz; the header has 'a', 'b'$",
    "x;y;z;qw;qx;qy;qz\n": r":1: missing .*; the file seems to be separated by semicolons, wanted commas",
    "x,x,y,z,qw,qx,qy,qz\n": r":1: column x is there 2 times",
    HEADER + GOOD + "0,0,oops,1,0,0,0\n": r":3:3: z is 'oops', wanted a number",
    HEADER + GOOD + "0,0,,1,0,0,0\n": r":3:3: z is empty, wanted a number",
    HEADER + GOOD + "0,0,1_0,1,0,0,0\n": r":3:3: z is '1_0', wanted a number",
    HEADER + GOOD + "\n0,nan,0,1,0,0,0\n": r":4:2: y is nan, wanted a finite number",
    HEADER + "inf,0,0,1,0,0,0\n": r":2:1: x is inf, wanted a finite number",
    HEADER + GOOD + "0,0,0,1,1,0,0\n": r":3:4: the quaternion has length 1\.41421356, wanted 1 within 1e-06",
    HEADER + "0,0,0,0,0,0,0\n": r":2:4: the quaternion has length 0, wanted 1",
    HEADER + "0,0,0,1.0000011,0,0,0\n": r":2:4: the quaternion has length 1\.0000011, wanted 1",
    HEADER + "0,0,0,0.707,0.707,0,0\n": r":2:4: .* length 0\.99984.*; where digits were left out divide",
    HEADER + "0,0,0,1\n": r":2: 4 fields, wanted 7 as in the header",
    HEADER + '0,0,0,1,0,0,"0\n': r":2: not CSV: unexpected end of data",
}


@pytest.mark.parametrize("text", BAD_POSES)
def test_what_is_wrong_with_poses(tmp_path: Path, text: str) -> None:
    (tmp_path / "p.csv").write_text(text)
    with pytest.raises(aa.ModelError, match=r"p\.csv" + BAD_POSES[text]):
        aa.io.load_poses(tmp_path / "p.csv")


def test_a_fault_far_down_is_found(tmp_path: Path) -> None:
    (tmp_path / "p.csv").write_text(HEADER + GOOD * 20000 + "0,0,0,1,0,x,0\n" + GOOD)
    with pytest.raises(aa.ModelError, match=r"p\.csv:20002:6: qy is 'x'") as caught:
        aa.io.load_poses(tmp_path / "p.csv")
    assert (caught.value.line, caught.value.column) == (20002, 6)


BAD_FILES = {
    "p.csv": (b"\xff\xfe\x00", r"p\.csv: not UTF-8 text"),
    "p.npz": (b"no zip", r"p\.npz: not NPZ"),
    "p.json": (b"{\n 3}", r"p\.json:2:2: not JSON: "),
    "q.json": (b"\xff", r"q\.json: not UTF-8 text"),
    "r.json": (b"[1]", r"r\.json: holds a list, wanted an object"),
    "s.json": (b'{"a": 1}', r"s\.json: missing 'pose'; the file has 'a'"),
    "t.json": (b'{"pose": [[1, 2], [3]]}', r"t\.json: holds a column whose rows are not of one length"),
    "u.json": (b'{"pose": [[1, 2]]}', r"u\.json: pose has shape \(1, 2\), wanted numbers of shape \(N, 7\)"),
    "v.json": (b'{"pose": [["a"]]}', r"v\.json: pose is not an array of numbers"),
    "w.json": (b'{"pose": [[0,0,0,1,1,0,0]]}', r"w\.json: pose\[0\]: the quaternion has length 1\.414"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_what_is_wrong_with_files(tmp_path: Path, name: str) -> None:
    data, message = BAD_FILES[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(aa.ModelError, match=message):
        aa.io.load_poses(tmp_path / name)


@pytest.mark.parametrize("ending", ENDINGS)
def test_files_that_cannot_be_read(tmp_path: Path, ending: str) -> None:
    with pytest.raises(aa.ModelError, match="no such file"):
        aa.io.load_poses(tmp_path / f"absent{ending}")
    with pytest.raises(aa.ModelError, match="cannot be read: a folder, wanted a file"):
        (tmp_path / f"d{ending}").mkdir()
        aa.io.load_joints(tmp_path / f"d{ending}")


Q = "q1,q2,q3,q4,q5,q6,q7"
BAD_JOINTS = {
    f"{Q}\n0,0,0,0,0,0,inf\n": r":2:7: q7 is inf, wanted a joint value in rad",
    f"{Q},gc\n0,0,0,0,0,0,0,8\n": r":2:8: gc is 8, wanted a whole number from 0 to 7, or -1",
    f"gc,{Q}\n0.5,0,0,0,0,0,0,0\n": r":2:1: gc is 0\.5, wanted",
    f"{Q},status\n0,0,0,0,0,0,0,FINE\n": r":2:8: status is 'FINE', wanted one of OK, UNREACHABLE",
    "q1,q2\n": r":1: missing column q3, q4, q5, q6, q7; the header has 'q1', 'q2'",
}


@pytest.mark.parametrize("text", BAD_JOINTS)
def test_what_is_wrong_with_joints(tmp_path: Path, text: str) -> None:
    (tmp_path / "j.csv").write_text(text)
    with pytest.raises(aa.ModelError, match=r"j\.csv" + BAD_JOINTS[text]):
        aa.io.load_joints(tmp_path / "j.csv")


def test_what_is_wrong_with_joint_blocks(tmp_path: Path) -> None:
    file = tmp_path / "j.json"
    file.write_text(json.dumps({"q": [[0] * 7], "psi": [0, 0]}))
    with pytest.raises(aa.ModelError, match=r"j\.json: psi has 2 rows and q has 1"):
        aa.io.load_joints(file)
    file.write_text(json.dumps({"q": [[0] * 7], "status": ["BAD"]}))
    with pytest.raises(aa.ModelError, match=r"j\.json: row 0: status is 'BAD'"):
        aa.io.load_joints(file)
