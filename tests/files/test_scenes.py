"""Scenes and bodies from files, and what is wrong with them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.refused import Row, not_refused

import armangle as aa
from armangle.files.scenes import body_toml

CELL = """
clearance = 0.02
ignore = [["table", "link_0"]]
[[ball]]
name = "lamp"
center = [0.4, 0, 0.5]
radius = 0.1
[[capsule]]
begin = [0, 0, 1]
end = [0, 1, 1]
radius = 0.05
[[box]]
name = "table"
size = [1, 2, 0.04]
position = [0.5, 0, 0.2]
rpy = [0, 0, 0.3]
radius = 0.01
[[half_space]]
normal = [0, 0, 1]
offset = -0.5
"""
SHAPES = """
[[hull]]
name = "wedge"
points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]
radius = 0.01
[[hull]]
file = "corners.csv"
[[field]]
name = "seen"
file = "seen.npz"
"""
MOVEIT = """(noname)+
* shelf
0.5 0 0.2
0 0 0.7071067811865476 0.7071067811865476
1
box
0.4 0.2 0.1
0.1 0 0
0 0 0 1
0 0 0 0
1
handle
0 0 0
0 0 0 1
* post
0 1 0
0 0 0 1
2
cylinder
0.05 0.8
0 0 0.4
0 0 0 1
0 0 0 0
sphere
0.1
0 0 1
0 0 0 1
0 0 0 0
0
.
"""
OLD = """noname
* box
1
box
0.1 0.2 0.3
1 2 3
0 0 0 1
0 0 0 0
.
"""


def file(tmp_path: Path, text: str, name: str = "cell.toml") -> Path:
    """Write a text to a file and return its path."""
    path = tmp_path / name
    path.write_text(text)
    return path


def test_a_scene_is_what_its_tables_say(tmp_path: Path) -> None:
    """`load_scene` of TOML has the shapes, clearance and ignored pairs of its tables."""
    scene = aa.io.load_scene(file(tmp_path, CELL))
    box = aa.Box(aa.pose([0.5, 0, 0.2], rpy=[0, 0, 0.3]), [1, 2, 0.04], 0.01, name="table")
    assert set(scene.shapes) == {
        aa.Ball([0.4, 0, 0.5], 0.1, name="lamp"), aa.Capsule([0, 0, 1], [0, 1, 1], 0.05), box,
        aa.HalfSpace([0, 0, 1], -0.5),
    }  # fmt: skip
    assert scene.clearance == 0.02 and scene.ignore == (("table", "link_0"),)


def test_the_scenes_of_moveit_are_read(tmp_path: Path) -> None:
    """`load_scene` reads both text formats of MoveIt; a cylinder is covered."""
    scene = aa.io.load_scene(file(tmp_path, MOVEIT, "cell.scene"))
    shelf = scene.shapes[0]
    assert isinstance(shelf, aa.Box) and shelf.name == "shelf" and shelf.size == (0.4, 0.2, 0.1)
    turned = aa.pose([0.5, 0.1, 0.2], rpy=[0, 0, np.pi / 2])
    assert np.allclose(shelf.pose, turned, rtol=0, atol=1e-12)
    posts = scene.shapes[1:]
    assert all(name.startswith("post_") for name in scene.names[1:])
    assert posts[-1] == aa.Ball([0, 1, 1], 0.1, name=scene.names[-1])
    ends = [np.array([x, 1, z]) for x in (-0.05, 0.05) for z in (0.0, 0.8)]
    for end in ends:  # the cylinder's rims
        near = [np.linalg.norm(end - _nearest(post, end)) - post.radius for post in posts[:-1]]
        assert min(near) < 1e-8
    old = aa.io.load_scene(file(tmp_path, OLD, "old.scene")).shapes
    assert old == (aa.Box(aa.pose([1, 2, 3]), [0.1, 0.2, 0.3], name="box"),)


def _nearest(post: aa.Ball | aa.Capsule, point: np.ndarray) -> np.ndarray:
    """Return the point of the core of a shape that is nearest to a point."""
    if isinstance(post, aa.Ball):
        return np.array(post.center)
    begin, along = np.array(post.begin), np.subtract(post.end, post.begin)
    return begin + along * np.clip((point - begin) @ along / (along @ along), 0, 1)


def test_a_body_comes_back_from_its_text(tmp_path: Path) -> None:
    """`load_body` reads what `body_toml` wrote, and [bones]."""
    body = aa.Body(
        {3: [aa.Ball([0, 0.1, 0.2], 0.1, name='a "b"')], 6: [aa.Capsule([0, 0, 0], [0, 0, 0.1], 0.05)]},
        ignore=[("a", "link_6")],
    )
    assert aa.io.load_body(file(tmp_path, body_toml(body))) == body
    bones = file(tmp_path, "[bones]\nupper_arm = 0.09\nforearm = 0.08", "bones.toml")
    assert aa.io.load_body(bones) == aa.Body.bones(upper_arm=0.09, forearm=0.08)


BALL = "[[ball]]\ncenter = [0, 0, 0]\nradius = 1"
WRONG = [
    ("[[bal]]\n", "key is 'bal', wanted one of ball, box"), ("[ball]\nradius = 1", r"ball is .*\[\[ball\]\]"),
    ("[[ball]]\ncentre = [0, 0, 0]\nradius = 1", r"\[\[ball\]\] 0: key is 'centre', wanted one of center"),
    ("[[ball]]\nradius = 1", r"\[\[ball\]\] 0: center is missing"),
    ("[[ball]]\ncenter = [0, 0]\nradius = 1", r"\[\[ball\]\] 0: Ball: center is \[0, 0\]"),
    ("[[ball]]\ncenter = [0, 0, nan]\nradius = 1", "center is"), ("clearance = ", "wanted TOML"),
    ("[[box]]\nsize = [1, 1, 1]\nposition = [0, 0]", r"\[\[box\]\] 0: position, rpy"),
    ("obstacles = []\nclearance = -1", r"Scene: clearance is -1"),
    ("[[box]]\nsize = [1, 1, 1]\nposition = [0, 0, 0]\nrpy = [0, 0, 90]", r"rpy holds 90.*degrees\?"),
    ("[[cloud]]\nfile = 'cell.npz'\nradius = 0.01", "it is no NPZ"),
    ("[[field]]\nfile = 'cell.npz'", "not NPZ"),
    (2 * f"{BALL}\nname = 'a'\n", r"shapes\[1\]: name is 'a'"),
    ("[[hull]]\npoints = [[0, 0, 0]]\nfile = 'corners.csv'", "points or a file"),
    ("[[hull]]\nradius = 1", "points or a file"), ("[[hull]]\npoints = []", "an array of shape"),
    ("[[hull]]\nfile = 3", "the name of a file"), ("[[field]]\nfile = 'none.npz'", "no such file"),
    ("[[field]]\nname = 'x'", "file is missing"), ("[[hull]]\npoints = [[0, 0, 0]]\ncolour = 3", "one of"),
    *((text, "obstacles is missing") for text in ("", "clearance = 0.1", "# nothing")),
    *((text, r"obstacles is .*, wanted \[\]")
      for text in (f"obstacles = []\n{BALL}", "obstacles = [1]", "obstacles = 0")),
]  # fmt: skip
WRONG_TEXT = [
    (MOVEIT.replace("box", "cone"), "is 'cone'"),
    (MOVEIT.replace("0.4 0.2 0.1", "0.4 0.2"), "line 7 .* '0.4 0.2'"),
    (MOVEIT.replace("0 0 0 1", "0 0 0 0"), "a quaternion x y z w of length 1"),
    ("x\nbox\n", "wanted an object"),
    (OLD[:20], "wanted"), *((text, "objects is None") for text in ("", "(noname)+", "(noname)+\n.")),
]  # fmt: skip
WRONG_BODY = [
    (BALL, "link is missing, .* load_scene"), (f"{BALL}\nlink = 9", "wanted a DH frame"),
    ("[bones]\nupper_arm = 0.1", r"\[bones\]: forearm is missing"), ("bones = 3", "wanted a table"),
    ("[bones]\nupper_arm = 0.1\nforearm = 0.1\nthick = 1", "key is 'thick'"), ("", "Body: links is"),
    ("[[box]]", "key is 'box'"),
]  # fmt: skip


def test_what_is_wrong_is_said_with_the_file_and_the_table(tmp_path: Path) -> None:
    """`load_scene` and `load_body` refuse faulty files with file and table."""
    (tmp_path / "cell.npz").write_bytes(bytes(50))
    (tmp_path / "corners.csv").write_text("0,0,0\n")
    rows: list[Row] = []
    of_scene = (aa.io.load_scene, "cell.toml", WRONG), (aa.io.load_scene, "cell.scene", WRONG_TEXT)
    for load, name, wrong in (*of_scene, (aa.io.load_body, "cell.toml", WRONG_BODY)):
        for text, why in wrong:

            def ask(load: Any = load, text: str = text, name: str = name) -> object:
                return load(file(tmp_path, text, name))

            rows.append((aa.SceneError, f"cell.*{why}", ask))
    assert not_refused(rows) == []
    for load in (aa.io.load_scene, aa.io.load_body):
        with pytest.raises(aa.SceneError, match=r"no\.toml'"):
            load(tmp_path / "no.toml")
        (tmp_path / "b.toml").write_bytes(b"\xff\x00")
        with pytest.raises(aa.SceneError, match="wanted a text file"):
            load(tmp_path / "b.toml")


def test_hulls_and_fields_are_read(tmp_path: Path) -> None:
    """`load_scene` reads hulls and fields from the files that its tables name."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    np.savetxt(tmp_path / "corners.csv", corners, delimiter=",")
    np.savez(tmp_path / "seen.npz", distance=np.ones((2, 3, 4)), origin=[0, 0, 1], spacing=0.5)
    scene = aa.io.load_scene(file(tmp_path, SHAPES))
    assert scene.shapes == (
        aa.Hull(corners, 0.01, name="wedge"), aa.Hull(corners),
        aa.Field(np.ones((2, 3, 4)), [0, 0, 1], 0.5, name="seen"),
    )  # fmt: skip
    assert aa.io.load_scene(file(tmp_path, "obstacles = []\nclearance = 0.1")) == aa.Scene(clearance=0.1)
