"""What the viewer draws an arm with: capsules, and the meshes of a URDF."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from support.chains import read_urdf
from support.needs import need

import armangle as aa
from armangle.viewer.meshes import solids_of
from armangle.viewer.solids import capsules
from armangle.viewer.surfaces import surface

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
WAM = aa.Arm.from_catalogue("barrett_wam7")
FR3 = aa.Arm.from_catalogue("franka_fr3")
PR2 = aa.Arm.from_catalogue("willow_garage_pr2_left")


def test_a_capsule_is_closed_and_of_its_radius() -> None:
    """All vertices of a capsule's surface are at its radius, and its faces enclose its volume."""
    begin, end = np.array([0.1, 0.2, 0.3]), np.array([0.1, 0.7, 0.9])
    vertices, faces = surface(aa.Capsule(begin, end, 0.05), 1.0)
    axis = (end - begin) / np.linalg.norm(end - begin)
    along = np.clip((vertices - begin) @ axis, 0, np.linalg.norm(end - begin))
    distance = np.linalg.norm(vertices - begin - along[:, None] * axis, axis=1)
    np.testing.assert_allclose(distance, 0.05, atol=1e-12)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    volume = np.einsum("ij,ij->i", corners[:, 0] - begin, normals).sum() / 6
    length = np.linalg.norm(end - begin)
    assert volume == pytest.approx(np.pi * 0.05**2 * (length + 4 / 3 * 0.05), rel=0.03)


@pytest.mark.parametrize("arm", [IIWA, WAM, FR3, PR2], ids=lambda arm: arm.name)
def test_capsules_move_with_the_arm(arm: aa.Arm) -> None:
    """`capsules` has the links that an arm has, and the hand where `frames` puts it."""
    q = np.random.default_rng(2).uniform(-1, 1, 7)
    frames = arm.frames(q)
    solids = {solid.name: solid for solid in capsules(arm)}
    assert ("elbow_in" in solids) == (arm in (WAM, FR3))
    assert ("wrist" in solids, "shoulder" in solids) == (arm is FR3, arm is PR2)
    hand = solids["hand"]
    placed = hand.vertices @ frames[hand.frame, :3, :3].T + frames[hand.frame, :3, 3]
    middle = 0.5 * (placed.max(axis=0) + placed.min(axis=0))
    np.testing.assert_allclose(middle, frames[[6 if arm is FR3 else 5, 7], :3, 3].mean(axis=0), atol=2e-3)


_STL = "solid t\n" + "".join(
    f"facet normal 0 0 1\nouter loop\n{corners}endloop\nendfacet\n"
    for corners in (
        "vertex 0 0 0\nvertex 0 0.1 0\nvertex 0.1 0 0\n",
        "vertex 0 0 0\nvertex 0.1 0 0\nvertex 0 0 0.1\n",
        "vertex 0 0 0\nvertex 0 0 0.1\nvertex 0 0.1 0\n",
        "vertex 0.1 0 0\nvertex 0 0.1 0\nvertex 0 0 0.1\n",
    )
)  # fmt: skip


def _urdf(tmp_path: Path, visuals: dict[str, str]) -> Path:
    """Write the iiwa as URDF with visuals on links."""
    text = IIWA.to_urdf()
    for link, visual in visuals.items():
        plain = f'<link name="{link}" />'
        assert plain in text
        text = text.replace(plain, f'<link name="{link}"><visual>{visual}</visual></link>')
    path = tmp_path / "arm.urdf"
    path.write_text(text)
    return path


def _links(path: Path) -> list[str]:
    """The names of all links in a URDF file, in order."""
    return [line.split('"')[1] for line in path.read_text().splitlines() if "<link " in line]


def test_meshes_of_a_urdf_are_drawn_where_the_file_puts_them(tmp_path: Path) -> None:
    """`solids_of` draws meshes and boxes of a URDF with frame, scale and colour, capsules elsewhere."""
    need("trimesh")
    links = _links(_urdf(tmp_path, {}))
    (tmp_path / "my_robot" / "meshes").mkdir(parents=True)
    (tmp_path / "my_robot" / "meshes" / "tip.stl").write_text(_STL + "endsolid t\n")
    mesh = '<geometry><mesh filename="package://my_robot/meshes/tip.stl" scale="2 2 2"/></geometry>'
    visual = f'<origin xyz="0.01 0.02 0.03" rpy="0.1 0.2 0.3"/>{mesh}'
    pink = '<material name="m"><color rgba="1 0 0.5 1"/></material>'
    box = f'<geometry><box size="0.1 0.2 0.3"/></geometry>{pink}'
    path = _urdf(tmp_path, {links[3]: visual, links[0]: box})
    arm = aa.Arm.from_urdf(path)
    solids, note = solids_of(arm, path)
    assert note == ""
    own = {solid.name: solid for solid in solids}
    assert own[f"{links[0]}_0"].colour == (255, 0, 128)
    np.testing.assert_allclose(np.ptp(own[f"{links[0]}_0"].vertices, axis=0), [0.1, 0.2, 0.3], atol=1e-9)
    assert np.ptp(own[f"{links[3]}_0"].vertices, axis=0).max() > 0.19
    assert own[f"{links[3]}_0"].frame == 3
    assert "upper_arm" not in own
    assert "forearm" in own


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("package://nowhere/none.stl", "no such file"),
        ("http://127.0.0.1:9/a.stl", "only local files are read"),
        ("broken.stl", ""),
        ("a.unknown", ""),
    ],
)
def test_an_unreadable_mesh_is_a_capsule_and_said_once(tmp_path: Path, name: str, why: str) -> None:
    """`solids_of` draws unreadable meshes as capsules, with one note that counts them and names the first.

    Where `why` is "", any reason will do.
    """
    need("trimesh")
    (tmp_path / "broken.stl").write_bytes(b"\x00" * 10)
    (tmp_path / "a.unknown").write_text("x")
    links = _links(_urdf(tmp_path, {}))
    visual = f'<geometry><mesh filename="{name}"/></geometry>'
    path = _urdf(tmp_path, {links[2]: visual, links[3]: visual})
    solids, note = solids_of(aa.Arm.from_urdf(path), path)
    assert note.startswith(f"2 meshes are drawn as capsules; the first: {links[2]}_0: ")
    assert why in note
    assert {solid.name for solid in solids} == {solid.name for solid in capsules(IIWA)}


@pytest.mark.parametrize("number", range(1, 8))
def test_a_mesh_moves_with_its_link(number: int, tmp_path: Path) -> None:
    """A mesh of `solids_of`, placed by `frames`, is where the URDF has it."""
    need("trimesh")
    links = _links(_urdf(tmp_path, {}))
    visual = '<origin xyz="0.1 0.2 0.3"/><geometry><box size="0.01 0.01 0.01"/></geometry>'
    path = _urdf(tmp_path, {links[number]: visual})
    arm = aa.Arm.from_urdf(path)
    box = next(solid for solid in solids_of(arm, path)[0] if solid.name == f"{links[number]}_0")
    q = np.random.default_rng(number).uniform(-1, 1, 7)
    placed = arm.frames(q)[box.frame]
    drawn = placed[:3, :3] @ box.vertices.mean(axis=0) + placed[:3, 3]
    chain = read_urdf(path)
    upto = dataclasses.replace(chain, joints=chain.joints[:number], tip_origin=np.eye(4))
    link = upto.forward(q[:number])
    np.testing.assert_allclose(drawn, link[:3, :3] @ [0.1, 0.2, 0.3] + link[:3, 3], atol=1e-9)
