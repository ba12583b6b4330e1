"""What every reader opens: regular files of a bounded length; and what is said of them is short."""

from __future__ import annotations

import os
import pickle
import socket
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from support.needs import need

import armangle as aa
from armangle import _opening, errors
from armangle.cli import main
from armangle.files.tables import sample_times
from armangle.models.catalogue import read_robot
from armangle.models.mjcf import is_mjcf
from armangle.models.urdf.shapes import mesh_file

READERS: dict[str, tuple[Callable[[Path], Any], tuple[str, ...]]] = {
    "poses": (aa.io.load_poses, (".csv", ".npz", ".json")),
    "joints": (aa.io.load_joints, (".csv", ".npz", ".json")),
    "trajectory": (aa.io.load_trajectory, (".csv", ".npz", ".json", ".yaml")),
    "times": (sample_times, (".csv",)),
    "scene": (aa.io.load_scene, (".toml", ".scene")),
    "body": (aa.io.load_body, (".toml",)),
    "cloud": (lambda path: aa.io.load_cloud(path, 0.01), (".npz", ".npy", ".csv", ".ply", ".pcd")),
    "field": (aa.io.load_field, (".npz",)),
    "robot": (read_robot, (".toml",)),
    "URDF": (aa.Arm.from_urdf, (".urdf",)),
    "URDF, offset": (aa.Arm.from_urdf, (".urdf",)),
    "URDF, body": (aa.Body.from_urdf, (".urdf",)),
    "MJCF": (aa.Arm.from_mjcf, (".xml",)),
    "MJCF, offset": (aa.Arm.from_mjcf, (".xml",)),
    "MJCF, body": (aa.Body.from_mjcf, (".xml",)),
    "mesh": (lambda path: mesh_file(path.name, path.parent), (".stl", ".obj")),
}


def pipe(path: Path) -> None:
    """Make a named pipe."""
    os.mkfifo(path)


def device(path: Path) -> None:
    """Make a link to a device that never ends."""
    path.symlink_to("/dev/zero")


def listening(path: Path) -> None:
    """Make a socket."""
    with socket.socket(socket.AF_UNIX) as end:
        here = Path.cwd()
        os.chdir(path.parent)  # the name of a socket may not be long
        try:
            end.bind(path.name)
        finally:
            os.chdir(here)


def long(path: Path) -> None:
    """Make a file longer than any reader takes, without using the disk."""
    with path.open("wb") as file:
        file.truncate(_opening.NUMBERS + 1)  # without a block of the disk


PLACES: dict[str, tuple[Callable[[Path], None], str]] = {
    "a pipe": (pipe, "a pipe, wanted a file"),
    "a device": (device, "a device, wanted a file"),
    "a socket": (listening, "a socket, wanted a file"),
    "a folder": (Path.mkdir, "a folder, wanted a file"),
    "too long": (long, "MiB, wanted at most"),
    "nothing": (lambda path: None, "no such file"),
}


@pytest.mark.parametrize("name", READERS)
def test_every_reader_refuses_what_is_no_file(tmp_path: Path, name: str) -> None:
    """Every reader refuses pipes, devices, sockets, folders, long and missing files, by name."""
    if name.startswith("MJCF"):
        need("mujoco")
    read, endings = READERS[name]
    for number, (make, why) in enumerate(PLACES.values()):
        for ending in endings:
            path = tmp_path / f"it{number}{ending}"
            make(path)
            with pytest.raises(aa.InputError if name != "mesh" else ValueError, match=why) as raised:
                read(path)
            assert path.name in str(raised.value)
            assert is_mjcf(path) is False


def test_a_file_that_grows_is_read_as_far_as_the_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`bytes_of` refuses a file that is longer than its stated length, beyond the bound."""
    said: list[str] = []

    def fail(why: str) -> Any:
        said.append(why)
        raise aa.InputError(why)

    (tmp_path / "a").write_bytes(bytes(10))
    assert _opening.bytes_of(tmp_path / "a", 10, fail) == bytes(10)
    monkeypatch.setattr(os, "fstat", lambda _: os.stat_result([0] * 10))  # as of files of the kernel's own
    with pytest.raises(aa.InputError):
        _opening.bytes_of(tmp_path / "a", 9, fail)
    assert said == ["10 bytes, wanted at most 9 bytes"]


# -- TOML ------------------------------------------------------------------------------------------------

BOMBS = (
    ".".join(["a"] * 50_000) + " = 1", "[" + " . ".join(["a"] * 50_000) + "]",
    ".".join(["'a'", '"b"'] * 25_000) + " = 1", "x = {" + ".".join(["a"] * 50_000) + " = 1}",
    "a = " + "[" * 100_000 + "]" * 100_000, "a = " + "{a = " * 50_000 + "1" + "}" * 50_000,
    "a = " + "1" * 10_000, 'a = """' + '\\"""' * 100_000,
)  # fmt: skip
"""Dotted keys, headers and inline tables; arrays and tables in each other; a number; a string without end."""


@pytest.mark.turns(3)
@pytest.mark.parametrize("load", [aa.io.load_scene, aa.io.load_body, read_robot])
def test_toml_that_would_take_all_memory(tmp_path: Path, load: Callable[[Path], Any]) -> None:
    """Readers of TOML refuse deep nesting, long keys and long numbers."""
    for bomb in BOMBS:
        (tmp_path / "it.toml").write_text(bomb)
        with pytest.raises(aa.InputError, match=r"it\.toml"):
            load(tmp_path / "it.toml")


def test_dots_in_strings_and_comments_are_no_keys() -> None:
    """`parse_toml` counts no dots in strings and comments."""
    dots = ".".join("abcdefghij" * 10)
    text = f"""# {dots} = 1
a.b = "{dots} = # [ {{ \\" "  # {dots}
c = '{dots}'
d = '''
{dots} = "
'''
e = \"\"\"
\\\"\\\"\\\" {dots} = '
\"\"\"
"""
    assert _opening.parse_toml(text)["c"] == dots


# -- numbers ---------------------------------------------------------------------------------------------


def test_a_header_of_many_columns_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Readers of CSV refuse a header of many other columns with a short message."""
    path = tmp_path / "wide.csv"
    for columns in (2_000, 1_000_000):
        path.write_text(",".join(f"c{i}" for i in range(columns)) + "\n")
        for load in (aa.io.load_poses, aa.io.load_joints, aa.io.load_trajectory):
            with pytest.raises(aa.ModelError) as raised:
                load(path)
            assert len(str(raised.value)) < 1000
    assert main(["plan", str(path), "--robot", "kuka_iiwa7_r800"]) == 2
    assert len(capsys.readouterr().err) < 1000


def test_a_row_without_end_is_refused(tmp_path: Path) -> None:
    """`load_poses` refuses a row of CSV of more than 65536 characters."""
    for cell in ('"' + "\n" * 200_000 + '"', ",".join(['"\n"'] * 200_000), "1" * 200_000):
        (tmp_path / "long.csv").write_text(f"x,y,z,qw,qx,qy,qz\n{cell},0,0,1,0,0,0\n")
        with pytest.raises(aa.ModelError, match="a row of more than 65536"):
            aa.io.load_poses(tmp_path / "long.csv")


def test_an_archive_that_unpacks_to_more_than_memory_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Readers of NPZ refuse an archive that unpacks to more than the bound."""
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("points.npy", bytes(2**20))
    monkeypatch.setattr(_opening, "NUMBERS", 2**19)
    for load in (aa.io.load_poses, lambda path: aa.io.load_cloud(path, 0.01), aa.io.load_field):
        with pytest.raises(aa.InputError, match="it unpacks to more than"):
            load(tmp_path / "bomb.npz")


def test_a_cloud_cannot_ask_for_more_memory_than_its_file_has(tmp_path: Path) -> None:
    """`load_cloud` refuses an array whose header states more points than its file holds."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({10**15}, 3), }}\n".encode()
    data = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header
    (tmp_path / "it.npy").write_bytes(data)
    with zipfile.ZipFile(tmp_path / "it.npz", "w") as archive:
        archive.writestr("points.npy", data)
    for name in ("it.npy", "it.npz"):
        with pytest.raises(aa.SceneError, match=name):
            aa.io.load_cloud(tmp_path / name, 0.01)


# -- messages --------------------------------------------------------------------------------------------


def test_no_message_is_long() -> None:
    """Messages of errors have at most 4000 characters, begin and end kept, and can be pickled."""
    text = "begin" + "x" * 10_000_000 + "end"
    for kind in vars(errors).values():
        if not (isinstance(kind, type) and issubclass(kind, aa.ArmangleError)):
            continue
        made = kind(text, "a", text, text) if kind is aa.SceneError else kind(text)
        said = str(made)
        assert len(said) <= 4000 and said.startswith("begin") and said.endswith("end"), kind
        assert str(pickle.loads(pickle.dumps(made))) == said
    with pytest.raises(aa.ModelError) as raised:
        aa.Arm.from_urdf(f"<robot name='a'><link name='{'l' * 1_000_000}'/></robot>")
    assert len(str(raised.value)) <= 4000
