"""Clouds from files: all endings hold the same points, and what is broken is said."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.refused import not_refused

import armangle as aa

POINTS = np.random.default_rng(3).normal(size=(50, 3)).astype(np.float32).astype(np.float64)
HEAD = "element vertex 50\nproperty float x\nproperty uchar red\nproperty float y\nproperty float z\n"
PCD = "VERSION 0.7\nFIELDS x y z _ rgb\nSIZE 4 4 4 1 4\nTYPE F F F U F\nCOUNT 1 1 1 4 1\nPOINTS 50\n"


def texts() -> dict[str, bytes]:
    """The bytes of a file of each kind, by name, with POINTS."""
    rows = [(*p, 7) for p in POINTS.tolist()]
    mixed = np.zeros(50, dtype=[("x", "<f4"), ("r", "u1"), ("y", "<f4"), ("z", "<f4")])
    padded = np.zeros(50, dtype=[("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("_", "u1", (4,)), ("rgb", "<f4")])
    for table in (mixed, padded):
        for k, axis in enumerate("xyz"):
            table[axis] = POINTS[:, k]
    ply = f"ply\nformat FORM 1.0\n{HEAD}element face 0\nproperty list uchar int i\nend_header\n"
    return {
        "a.csv": ("z,x,y\n" + "\n".join(f"{z!r},{x!r},{y!r}" for x, y, z, _ in rows)).encode(),
        "b.csv": "\n".join(f"{x!r},{y!r},{z!r}" for x, y, z, _ in rows).encode(),
        "c.ply": (
            ply.replace("FORM", "ascii") + "\n".join(f"{x!r} {r} {y!r} {z!r}" for x, y, z, r in rows)
        ).encode(),
        "d.ply": ply.replace("FORM", "binary_little_endian").encode() + mixed.tobytes(),
        "e.ply": ply.replace("FORM", "binary_big_endian").encode()
        + mixed.astype(mixed.dtype.newbyteorder(">")).tobytes(),
        "f.pcd": (
            PCD + "DATA ascii\n" + "\n".join(f"{x!r} {y!r} {z!r} 0 0 0 0 1" for x, y, z, _ in rows)
        ).encode(),
        "g.pcd": (PCD + "DATA binary\n").encode() + padded.tobytes(),
    }


def test_every_kind_of_file_holds_the_same_points(tmp_path: Path) -> None:
    """`load_cloud` reads the same points from CSV, PLY and PCD."""
    for name, content in texts().items():
        (tmp_path / name).write_bytes(content)
        found = aa.io.load_cloud(tmp_path / name, 0.01, name="seen")
        assert found == aa.Cloud(POINTS, 0.01, name="seen"), name


def test_arrays_are_read_and_what_is_not_seen_is_left_out(tmp_path: Path) -> None:
    """`load_cloud` reads NPY and NPZ, and leaves out points that are not finite."""
    seen = np.vstack([POINTS, [[np.nan, 0, 0]], [[0, np.inf, 0]]]).astype(np.float32)
    np.save(tmp_path / "a.npy", seen)
    np.savez(tmp_path / "b.npz", seen)
    np.savez(tmp_path / "c.npz", points=seen, colours=np.zeros(3))
    for name in ("a.npy", "b.npz", "c.npz"):
        assert aa.io.load_cloud(tmp_path / name, 0.02) == aa.Cloud(POINTS, 0.02)


def wrong() -> dict[str, tuple[bytes, str]]:
    """Broken files by name: their bytes, and a pattern of the message."""
    good = texts()
    return {
        "a.txt": (b"", "wanted a file ending in .npz"),
        "a.csv": (b"x,y\n1,2", "(of shape \\(N, 3\\)|could not convert|points x, y, z)"),
        "b.csv": (b"1,2\n3,4", r"points of shape \(N, 3\), not \(2, 2\)"),
        "c.csv": (b"1,2,x", "points x, y, z"),
        "d.ply": (good["d.ply"][:-5], "points x, y, z"),
        "e.ply": (b"plx", "no header of PLY"),
        "f.pcd": (good["g.pcd"].replace(b"DATA binary", b"DATA binary_compressed"), "only ascii and binary"),
        "g.pcd": (good["f.pcd"][:-600], "points x, y, z"),
        "h.npz": (b"PK", "points x, y, z"),
        "i.csv": (b"nan,nan,nan", "of which some are finite"),
        "j.csv": (b"", "it has no rows"),
        "k.csv": (b"x,y,z\n# nothing seen\n", "it has no rows"),
    }


def test_a_broken_file_is_refused_by_name(tmp_path: Path) -> None:
    """`load_cloud` refuses broken and missing files with their names."""
    said = {name: why for name, (_, why) in wrong().items()} | {"no.npy": "", "o.npy": "points x, y, z"}
    for name, (data, _) in wrong().items():
        (tmp_path / name).write_bytes(data)
    np.save(tmp_path / "o.npy", np.array([{}], dtype=object), allow_pickle=True)
    assert not_refused(
        (aa.SceneError, f"(?s)(?=.*{name})(.*{why})",
         lambda name=name: aa.io.load_cloud(tmp_path / name, 0.01))
        for name, why in said.items()
    ) == []  # fmt: skip


def test_a_scene_file_names_its_clouds(tmp_path: Path) -> None:
    """`load_scene` reads the cloud files that its tables name."""
    np.save(tmp_path / "seen.npy", POINTS)
    (tmp_path / "cell.toml").write_text('[[cloud]]\nfile = "seen.npy"\nradius = 0.02\nname = "seen"\n')
    assert aa.io.load_scene(tmp_path / "cell.toml").shapes == (aa.Cloud(POINTS, 0.02, name="seen"),)
    (tmp_path / "cell.toml").write_text('[[cloud]]\nfile = "none.npy"\nradius = 0.02\n')
    with pytest.raises(aa.SceneError, match=r"none\.npy"):
        aa.io.load_scene(tmp_path / "cell.toml")
