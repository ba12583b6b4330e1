"""Bodies of robot files: their balls and capsules contain every collision shape, where the file puts it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from support.chains import read_urdf
from support.draw import generator
from support.needs import need
from support.refused import Row, not_refused

import armangle as aa
from armangle.models.cover import Rod, box_mesh, cover_box, cover_cylinder, cover_mesh, merged, open_edges

Floats = NDArray[np.float64]
ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")


def outside(points: Floats, rods: list[Rod]) -> float:
    """The largest distance (m) of points (N, 3) from the union of all rods; negative inside."""
    apart = []
    for begin, end, radius in rods:
        along = end - begin
        share = np.clip((points - begin) @ along / max(float(along @ along), 1e-300), 0, 1)
        apart.append(np.linalg.norm(points - begin - share[:, None] * along, axis=1) - radius)
    return float(np.min(apart, axis=0).max())


def bent_tube(sides: int = 10, rings: int = 14) -> tuple[Floats, NDArray[np.int64]]:
    """Corners and triangles of a closed tube along a quarter circle."""
    turn = np.linspace(0, np.pi / 2, rings)
    around = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    ring = [
        np.stack([
            (0.2 + 0.05 * np.cos(around)) * np.cos(t), (0.2 + 0.05 * np.cos(around)) * np.sin(t),
            0.05 * np.sin(around),
        ], axis=1) for t in turn
    ]  # fmt: skip
    corners = np.concatenate([*ring, ring[0].mean(axis=0)[None], ring[-1].mean(axis=0)[None]])
    faces, n = [], sides * rings
    for k in range(sides):
        after = (k + 1) % sides
        for r in range(rings - 1):
            a, b, c, d = r * sides + k, r * sides + after, (r + 1) * sides + k, (r + 1) * sides + after
            faces += [(a, c, b), (b, c, d)]
        faces += [(n, k, after), (n + 1, (rings - 1) * sides + after, (rings - 1) * sides + k)]
    return corners, np.array(faces)


def in_tube(rng: np.random.Generator, count: int) -> Floats:
    """Random points inside the tube, a little thinner."""
    turn, angle = rng.uniform(0, np.pi / 2, count), rng.uniform(0, 2 * np.pi, count)
    off = 0.047 * np.sqrt(rng.uniform(0, 1, count))
    far = 0.2 + off * np.cos(angle)
    return np.stack([far * np.cos(turn), far * np.sin(turn), off * np.sin(angle)], axis=1)


@pytest.mark.parametrize("most", [1, 4, 12])
def test_a_tube_is_within_its_rods_with_all_that_it_holds(most: int) -> None:
    """`cover_mesh` with at most `most` rods covers a tube's surface and inside."""
    corners, faces = bent_tube()
    assert open_edges(faces) == 0
    rods = cover_mesh(corners, faces, most)
    assert len(rods) <= most
    rng = generator(1, most)
    weights = rng.dirichlet(np.ones(3), (len(faces), 20))
    surface = np.einsum("fnk,fkx->fnx", weights, corners[faces]).reshape(-1, 3)
    assert outside(surface, rods) <= 0
    assert outside(in_tube(rng, 20000), rods) <= 0


def test_a_corner_that_is_pulled_out_by_a_millimetre_is_covered_too() -> None:
    """`cover_mesh` covers a corner that is pulled out by 1 mm."""
    corners, faces = bent_tube()
    rods = cover_mesh(corners, faces, 4)
    for at in (0, 33, len(corners) - 1):
        pulled = corners.copy()
        out = corners[at] - [0.14, 0.14, 0.0]
        pulled[at] += out / np.linalg.norm(out) * 1e-3
        assert outside(pulled[[at]], cover_mesh(pulled, faces, 4)) <= 0
    # and what covers by less than that is found out
    tight = [Rod(rod.begin, rod.end, rod.radius - 1e-3) for rod in rods]
    assert outside(corners, rods) <= 0 < outside(corners, tight)


def test_more_rods_lie_closer() -> None:
    """`cover_mesh` with more rods has less volume."""
    corners, faces = bent_tube()
    volumes = [sum(rod.volume for rod in cover_mesh(corners, faces, most)) for most in (1, 3, 6, 12)]
    assert volumes == sorted(volumes, reverse=True)
    assert volumes[2] < 0.75 * volumes[0]


@pytest.mark.parametrize("size", [(0.1, 0.1, 0.1), (0.6, 0.1, 0.1), (0.5, 0.3, 0.02)])
def test_boxes_and_cylinders_are_within_their_rods(size: tuple[float, float, float]) -> None:
    """`cover_box` and `cover_cylinder` cover their shapes."""
    rng = generator(2)
    share = rng.uniform(-0.5, 0.5, (20000, 3))
    share[:8] = box_mesh(np.ones(3))[0]
    for most in (1, 5):
        assert outside(share * size, cover_box(np.array(size), most)) <= 0
        radius, length = size[1], size[0]
        turn, off = rng.uniform(0, 2 * np.pi, 20000), radius * np.sqrt(rng.uniform(0, 1, 20000))
        off[:5000] = radius
        height = rng.choice([-0.5, 0.5], 20000) * length
        height[10000:] = rng.uniform(-0.5, 0.5, 10000) * length
        points = np.stack([off * np.cos(turn), off * np.sin(turn), height], axis=1)
        assert outside(points, cover_cylinder(radius, length, most)) <= 0


def test_a_hole_is_seen_and_equal_corners_are_one() -> None:
    """`open_edges` counts edges of a hole, and none after `merged` joins equal corners."""
    corners, faces = bent_tube()
    assert open_edges(faces[1:]) == 3
    apart = corners[faces].reshape(-1, 3)
    alone = np.arange(len(apart)).reshape(-1, 3)
    assert open_edges(alone) > 0
    assert open_edges(merged(apart, alone)[1]) == 0


def links_of(text: str) -> list[str]:
    """The links of a URDF from base to tip."""
    return re.findall(r'<link name="([^"]+)"', text)


def written(tmp_path: Path, shapes: dict[int, str], arm: aa.Arm = ARM) -> Path:
    """Write a URDF of an arm with collision shapes by link, and return its path."""
    text = arm.to_urdf()
    for at, shape in shapes.items():
        name = links_of(arm.to_urdf())[at]
        text = text.replace(
            f'<link name="{name}" />', f'<link name="{name}"><collision>{shape}</collision></link>'
        )
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    return path


def stl(tmp_path: Path, corners: Floats, faces: NDArray[np.int64], name: str = "tube.stl") -> Path:
    """Write a mesh as text, and return its path."""
    lines = ["solid t"]
    for triangle in corners[faces]:
        rows = [f"vertex {x!r} {y!r} {z!r}" for x, y, z in triangle.tolist()]
        lines += ["facet normal 0 0 0", "outer loop", *rows, "endloop", "endfacet"]
    path = tmp_path / name
    path.write_text("\n".join([*lines, "endsolid t", ""]))
    return path


PLACE = '<origin xyz="0.01 -0.02 0.03" rpy="0.3 -0.2 0.5"/>'
BOX = f'{PLACE}<geometry><box size="0.1 0.14 0.2"/></geometry>'


@pytest.mark.turns(3)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["kuka_iiwa7_r800", "barrett_wam7", "openarm_v10"])
def test_the_body_of_a_file_is_where_its_links_are(tmp_path: Path, name: str) -> None:
    """`Body.from_urdf` covers boxes on all links where the file puts them."""
    arm = aa.Arm.from_catalogue(name)
    path = written(tmp_path, dict.fromkeys(range(8), BOX), arm)
    body, read = aa.Body.from_urdf(path), aa.Arm.from_urdf(path)
    assert [frame for frame, _ in body.links] == list(range(8))
    rng = generator(3)
    corners = aa.pose([0.01, -0.02, 0.03], rpy=[0.3, -0.2, 0.5]) @ np.vstack(
        [box_mesh(np.array([0.1, 0.14, 0.2]))[0].T, np.ones(8)]
    )
    chain = read_urdf(path)
    for _ in range(10):
        q = rng.uniform(-1.5, 1.5, 7)
        frames, frame = read.frames(q), np.eye(4)
        for link, shapes in body.links:
            if link:
                joint = chain.joints[link - 1]
                frame = frame @ joint.origin @ aa.pose([0, 0, 0], rotvec=joint.axis * q[link - 1])
            rods = [_as_rod(shape, frames[link]) for shape in shapes]
            points = (frame @ corners)[:3].T
            assert outside(points, rods) <= 1e-9
            assert min(np.abs(outside(point[None], [rod])) for point in points for rod in rods) < 1e-6


def test_sizes_of_a_file_mean_what_the_format_says(tmp_path: Path) -> None:
    """`Body.from_urdf` reads radius, length, size and origin of shapes as URDF means them."""
    shapes = {
        2: f'{PLACE}<geometry><cylinder radius="0.03" length="0.5"/></geometry>',
        4: f'{PLACE}<geometry><sphere radius="0.04"/></geometry>',
        6: f'{PLACE}<geometry><box size="0.02 0.02 0.6"/></geometry>',
    }
    path = written(tmp_path, shapes)
    body, place = aa.Body.from_urdf(path, shapes=1), aa.pose([0.01, -0.02, 0.03], rpy=[0.3, -0.2, 0.5])
    chain = read_urdf(path)
    q = np.array([0.3, -0.2, 0.5, 0.7, -0.4, 0.6, 0.1])
    frames, frame = aa.Arm.from_urdf(path).frames(q), np.eye(4)
    found = dict(body.links)
    assert set(found) == set(shapes)
    for link, joint in enumerate(chain.joints, start=1):
        frame = frame @ joint.origin @ aa.pose([0, 0, 0], rotvec=joint.axis * q[link - 1])
        if link not in found:
            continue
        here, (begin, end, radius) = frame @ place, _as_rod(found[link][0], frames[link])
        assert np.allclose((begin + end) / 2, here[:3, 3], rtol=0, atol=1e-3)
        if link == 4:
            assert np.allclose(begin, end) and radius == pytest.approx(0.04)
            continue
        along = (end - begin) / np.linalg.norm(end - begin)
        assert abs(along @ here[:3, 2]) > 0.9999  # z is the long one of both
        whole = np.linalg.norm(end - begin) + 2 * radius
        assert 0.03 <= radius < 0.035 if link == 2 else 0.0141 < radius < 0.017
        assert {2: 0.5, 6: 0.6}[link] <= whole < {2: 0.5, 6: 0.6}[link] + 0.07


def _as_rod(shape: Any, frame: Floats) -> Rod:
    """Return a ball or capsule as a rod in another frame."""
    ends = [shape.center] * 2 if isinstance(shape, aa.Ball) else [shape.begin, shape.end]
    begin, end = (frame[:3, :3] @ p + frame[:3, 3] for p in ends)
    return Rod(begin, end, shape.radius)


def test_a_mesh_is_read_and_its_link_named(tmp_path: Path) -> None:
    """`Body.from_urdf` covers a mesh, and names its shapes after the link."""
    need("trimesh")
    stl(tmp_path, *bent_tube())
    path = written(tmp_path, {3: f'{PLACE}<geometry><mesh filename="tube.stl"/></geometry>'})
    body = aa.Body.from_urdf(path, shapes=4)
    assert [frame for frame, _ in body.links] == [3] and 1 < len(body.links[0][1]) <= 4
    link = links_of(ARM.to_urdf())[3]
    arm = aa.Arm.from_urdf(path).with_(body=body)
    assert {shape.name for shape in body.links[0][1]} == {link}
    pose, psi, gc = arm.forward(np.full(7, 0.4))
    near = arm.clearance(arm.inverse(pose, psi, gc, limits=False), aa.Scene([aa.Ball([0, 0, 3], 0.1)]))
    assert near.link == link


MESH = '<geometry><mesh filename="{}"/></geometry>'
BAD = [
    (MESH.format("none.stl"), "none.stl: no such file"), (MESH.format("http://x/a.stl"), "only local files"),
    (MESH.format("open.stl"), "3 of its edges are open"), (MESH.format("mm.stl"), r"250 m across.*in mm\?"),
    (MESH.format("broken.stl"), "'broken.stl'"),
    (MESH.format('tube.stl" scale="1 x 1'), "a mesh that can be read"),
    ('<geometry><box size="1 2"/></geometry>', "has 2 numbers, wanted 3"),
    ('<geometry><box size="100 200 300"/></geometry>', "in metres"),
    ('<geometry><sphere radius="-1"/></geometry>', r"radius is -1.0"),
    ('<geometry><sphere radius="nan"/></geometry>', "is not finite"),
    ('<geometry><cylinder radius="0.1"/></geometry>', "not 1 number"),
    ('<geometry><cone radius="0.1"/></geometry>', "unknown geometry <cone>"),
    ("<geometry/>", "collision is None"),
]  # fmt: skip


def test_a_shape_that_cannot_be_covered_is_refused_by_name(tmp_path: Path) -> None:
    """`Body.from_urdf` refuses bad shapes and meshes with the link and the reason."""
    need("trimesh")
    corners, faces = bent_tube()
    stl(tmp_path, corners, faces)
    stl(tmp_path, corners, faces[1:], "open.stl")
    stl(tmp_path, 1000 * corners, faces, "mm.stl")
    (tmp_path / "broken.stl").write_bytes(b"\x00" * 10)
    link = links_of(ARM.to_urdf())[2]
    rows: list[Row] = [
        (aa.SceneError, f"(?s)(?=.*{link})(.*{why})",
         lambda shape=shape: aa.Body.from_urdf(written(tmp_path, {2: shape})))
        for shape, why in BAD
    ]  # fmt: skip
    rows += [
        (aa.SceneError, "shapes is .*, wanted an integer from 1 to 32",
         lambda n=n: aa.Body.from_urdf(ARM.to_urdf(), shapes=n)) for n in (0, 33, True, 1.5)
    ]  # fmt: skip
    rows.append((aa.SceneError, "collision shapes", lambda: aa.Body.from_urdf(ARM.to_urdf())))
    assert not_refused(rows) == []


def test_an_open_mesh_may_stand_for_its_hull(tmp_path: Path) -> None:
    """`Body.from_urdf(hulls=True)` covers the hull of an open mesh."""
    need("trimesh")
    need("scipy")
    corners, faces = bent_tube()
    stl(tmp_path, corners, faces[1:], "open.stl")
    body = aa.Body.from_urdf(
        written(tmp_path, {2: '<geometry><mesh filename="open.stl"/></geometry>'}), hulls=True
    )
    assert body.links[0][0] == 2


def test_covers_that_always_meet_are_let_touch_and_said(tmp_path: Path) -> None:
    """`Body.from_urdf` ignores pairs that always meet, and notes them."""
    wide = '<geometry><sphere radius="0.3"/></geometry>'
    small = '<geometry><sphere radius="0.05"/></geometry>'
    path = written(tmp_path, {3: wide, 5: wide, 1: small, 7: small})
    body = aa.Body.from_urdf(path)
    names = links_of(ARM.to_urdf())
    assert (names[3], names[5]) in body.ignore and (names[1], names[7]) not in body.ignore
    assert "not tested against each other" in body.notes[0]
    arm = aa.Arm.from_urdf(path).with_(body=body)
    pose, _, gc = arm.forward([0.3, 0.7, 0.2, -1.3, 0.4, 0.8, 0.1])
    assert arm._clear(pose, gc, aa.Scene()).status == aa.Status.OK


def test_geoms_of_a_model_are_covered_where_they_are() -> None:
    """`Body.from_mjcf` covers geoms of every type where MuJoCo puts them."""
    mujoco = need("mujoco")
    text = """<mujoco><worldbody><body name="base"><geom name="foot" type="cylinder" size="0.1 0.05"/>
      <body name="l1" pos="0 0 0.3"><joint name="j1" axis="0 0 1"/><geom type="sphere" size="0.06"/>
      <body name="l2"><joint name="j2" axis="0 1 0"/><geom type="capsule" size="0.04"
      fromto="0 0 0.1 0.02 0 0.2"/>
      <body name="l3"><joint name="j3" axis="0 0 1"/><geom type="box" pos="0 0 0.3" size="0.05 0.06 0.07"/>
      <body name="l4" pos="0 0 0.4"><joint name="j4" axis="0 1 0"/><geom type="ellipsoid"
      size="0.05 0.06 0.07"/>
      <body name="l5"><joint name="j5" axis="0 0 1"/><geom type="mesh" mesh="wedge" pos="0 0 0.2"/>
      <body name="l6" pos="0 0 0.4"><joint name="j6" axis="0 1 0"/><geom type="sphere" size="0.05" contype="0"
      conaffinity="0"/><body name="l7"><joint name="j7" axis="0 0 1"/><geom size="0.05" pos="0 0 0.1"/>
      <body name="finger"><joint name="f" type="slide"/><geom type="sphere" size="0.01"/></body>
      </body></body></body></body></body></body></body></body></worldbody>
      <asset><mesh name="wedge" vertex="0 0 0 0.1 0 0 0 0.1 0 0 0 0.2"/></asset></mujoco>"""
    body = aa.Body.from_mjcf(text, "base", "l7")
    arm = aa.Arm.from_mjcf(text, "base", "l7")
    assert [frame for frame, _ in body.links] == [0, 1, 2, 3, 4, 5, 7]
    assert "finger" in body.notes[0]
    model = mujoco.MjModel.from_xml_string(text)
    data, rng = mujoco.MjData(model), generator(4)
    for _ in range(5):
        data.qpos[:7] = q = rng.uniform(-1.5, 1.5, 7)
        mujoco.mj_kinematics(model, data)
        frames = arm.frames(q)
        for frame, shapes in body.links:
            rods = [_as_rod(shape, frames[frame]) for shape in shapes]
            for geom in range(model.ngeom):
                if model.body(model.geom_bodyid[geom]).name == shapes[0].name:
                    assert outside(_inside(model, data, geom, rng), rods) <= 1e-9


def _inside(model: Any, data: Any, geom: int, rng: np.random.Generator) -> Floats:
    """Random points of a geom, in the world."""
    size, kind = model.geom_size[geom], int(model.geom_type[geom])
    ball = rng.normal(size=(500, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    points = {
        2: ball * size[0],
        3: ball * size[0] + [0, 0, 1] * rng.uniform(-size[1], size[1], (500, 1)),
        4: ball * size, 6: rng.choice([-1, 1], (500, 3)) * size,
        5: ball * [1, 1, 0] / np.linalg.norm(ball[:, :2], axis=1)[:, None] * size[0] + [0, 0, size[1]],
        7: np.array(model.mesh_vert),
    }[kind]  # fmt: skip
    return points @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
