"""Covers of a robot file's collision shapes: the DH frame of each, and rods that contain it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._arrays import JOINTS, Floats
from ..errors import ArmangleError, SceneError, needed
from ..scenes.ready import TOO_LARGE
from .chain import Chain, chain_of, rigid_inverse
from .cover import Rod, cover_box, cover_cylinder, cover_mesh, merged, open_edges
from .description import ArmDescription
from .detect import chain_core
from .mjcf import MjcfModel, mjcf_geoms
from .one_offset import own_arm
from .urdf import Source, UrdfModel
from .urdf.shapes import mesh_file, numbers_of, origin_of, placed_elements

_POSTURES = 200
_SEED = 11


@dataclass
class Covered:
    """The result: rods by DH frame, each with the link that it covers; and notes for the user."""

    links: dict[int, list[tuple[str, Rod]]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    ignore: list[tuple[str, str]] = field(default_factory=list)

    def add(self, frame: int, link: str, place: Floats, rods: list[Rod]) -> None:
        """Add rods given in a frame whose pose in the DH frame is `place` (4, 4)."""
        turn, shift = place[:3, :3], place[:3, 3]
        for begin, end, radius in rods:
            moved = Rod(turn @ begin + shift, turn @ end + shift, radius)
            self.links.setdefault(frame, []).append((link, moved))


def link_frames(arm: ArmDescription, q: Floats) -> Floats:
    """Return the DH frames (8, 4, 4) of an arm at joints (7,), in the frame that poses are given in.

    For an arm with its own chain those of the true links.
    """
    if arm.chain is not None:
        out = np.empty((JOINTS + 1, 4, 4))
        chain_core(arm).frames_many(q, out, 1)
        return out
    *frames, tip = chain_of(arm).frames(q)
    return np.array([*frames, tip @ rigid_inverse(arm.tool)])


def cover_urdf(source: Source, base: str | None, tip: str | None, shapes: int, hulls: bool) -> Covered:
    """Return rods, at most `shapes` a shape, that contain every <collision> of the links from base to tip."""
    model = UrdfModel(source)
    chain, arm = own_arm(lambda offset: model.chain(base, tip, offset=offset))
    out, left = Covered(), list[str]()
    rest = link_frames(arm, np.zeros(JOINTS))
    try:
        for link, frame, place, element in placed_elements(model.text, chain, rest, "collision", left):
            where = f"link {link!r} of {chain.source}"
            rods = _urdf_rods(element, where, model.folder, shapes, hulls, _size(arm))
            out.add(frame, link, place @ origin_of(element), rods)
    except ValueError as error:
        raise _refusal(f"collision of {chain.source}", error) from None
    if left:
        out.notes.append(f"not covered, since they move by joints of their own: {', '.join(left)}")
    _finish(out, chain, arm)
    return out


def _refusal(where: str, error: ValueError) -> ArmangleError:
    """Return the error with the shape's place `where`; an `ArmangleError` as it is."""
    if isinstance(error, ArmangleError):
        return error
    return SceneError(where, "geometry", str(error), "a shape that can be read")


def _size(arm: ArmDescription) -> float:
    """Return the sum of an arm's lengths d_bs, d_se, d_ew and d_wf, m."""
    return arm.d_bs + arm.d_se + arm.d_ew + arm.d_wf


def _urdf_rods(element: Any, where: str, folder: Path, shapes: int, hulls: bool, size: float) -> list[Rod]:
    """Return rods that contain the shape of one <collision>, in its frame; `size` is that of the arm, m."""
    geometry = element.find("geometry")
    shape = None if geometry is None or not len(geometry) else geometry[0]
    if shape is None:
        raise SceneError(where, "collision", None, "a <geometry> with a shape in it")
    zero = np.zeros(3)
    try:
        match shape.tag:
            case "sphere":
                rods = [Rod(zero, zero, _positive(shape, "radius"))]
            case "box":
                rods = cover_box(numbers_of(shape.get("size"), 3), shapes)
            case "cylinder":
                rods = cover_cylinder(_positive(shape, "radius"), _positive(shape, "length"), shapes)
            case "capsule":
                half = np.array([0.0, 0.0, _positive(shape, "length") / 2])
                rods = [Rod(-half, half, _positive(shape, "radius"))]
            case "mesh":
                return _mesh_rods(shape, where, folder, shapes, hulls, size)
            case _:
                raise ValueError(f"unknown geometry <{shape.tag}>")
    except ValueError as error:
        raise _refusal(where, error) from None
    _refuse_unless_sized(where, shape.tag, max(2 * rod.radius for rod in rods), size)
    return rods


def _positive(shape: Any, name: str) -> float:
    """Return a positive number of an attribute; raise for anything else."""
    value = float(numbers_of(shape.get(name), 1)[0])
    if value <= 0:
        raise ValueError(f"{name} is {value}, wanted a length > 0")
    return value


def _mesh_rods(shape: Any, where: str, folder: Path, shapes: int, hulls: bool, size: float) -> list[Rod]:
    """Return rods that contain a mesh file, in the frame of its <collision>."""
    name = shape.get("filename", "")
    try:
        path = mesh_file(name, folder)
    except ValueError as error:
        raise SceneError(where, "mesh", str(error), "a file") from None
    trimesh: Any = needed("trimesh", "reading meshes needs", "view")
    try:
        mesh = trimesh.load(path, force="mesh")
        mesh.apply_scale(numbers_of(shape.get("scale"), 3, 1.0))
        vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)
    except Exception as error:  # mesh readers raise many kinds of errors for broken files
        why = str(error) or type(error).__name__
        raise SceneError(where, "mesh", name, f"a mesh that can be read ({why})") from None
    return solid_rods(vertices, faces, where, name, shapes, hulls, size)


def solid_rods(
    vertices: Floats, faces: NDArray[np.int64], where: str, name: str, shapes: int, hulls: bool, size: float
) -> list[Rod]:
    """Return at most `shapes` rods that contain a mesh and its interior.

    Raises `SceneError`, with `where` and `name`, if the mesh has no triangles, a number is not finite, or it
    is far larger than the arm (`size`, m). A mesh that is not closed raises too, or with `hulls` is replaced
    by its convex hull.
    """
    if not len(faces) or not np.isfinite(vertices).all():
        raise SceneError(where, "mesh", name, "a mesh with triangles, of finite numbers")
    _refuse_unless_sized(where, name, float(np.ptp(vertices, axis=0).max()), size)
    vertices, faces = merged(vertices, faces)
    lost = open_edges(faces)
    if lost and not hulls:
        wanted = f"a closed mesh, and {lost} of its edges are open; or hulls=True, for its convex hull"
        raise SceneError(where, "mesh", name, wanted)
    if lost:
        trimesh: Any = needed("trimesh", "convex hulls need", "view")
        needed("scipy", "convex hulls need", "time")
        hull = trimesh.convex.convex_hull(vertices)
        vertices, faces = np.asarray(hull.vertices, dtype=np.float64), np.asarray(hull.faces, dtype=np.int64)
    return cover_mesh(vertices, faces, shapes)


def _refuse_unless_sized(where: str, name: str, extent: float, size: float) -> None:
    """Raise if a shape (`extent`, m) is far larger than the arm (`size`, m), as one given in mm."""
    if extent > TOO_LARGE * size:
        wanted = f'a shape in metres of an arm {size:.3g} m long (in mm? then scale="0.001 0.001 0.001")'
        raise SceneError(where, name, f"{extent:.4g} m across", wanted)


def cover_mjcf(source: Any, base: str | None, tip: str | None, shapes: int) -> Covered:
    """Return rods that contain every colliding geom of the bodies from base to tip."""
    model = MjcfModel(source)
    chain, arm = own_arm(lambda offset: model.chain(base, tip, offset=offset))
    q, geoms, notes = mjcf_geoms(source, chain)
    rest = link_frames(arm, q)
    out = Covered(notes=notes)
    zero = np.zeros(3)
    for geom in geoms:
        where = f"geom {geom.name!r} of {chain.source}"
        match geom.kind:
            case "sphere":
                rods = [Rod(zero, zero, geom.size[0])]
            case "capsule":
                half = np.array([0.0, 0.0, geom.size[1]])
                rods = [Rod(-half, half, geom.size[0])]
            case "cylinder":
                rods = cover_cylinder(geom.size[0], 2 * geom.size[1], shapes)
            case "box" | "ellipsoid":
                rods = cover_box(2 * np.array(geom.size), shapes)
            case "mesh":
                rods = solid_rods(geom.vertices, geom.faces, where, "mesh", shapes, False, _size(arm))
            case _:
                wanted = "sphere, capsule, cylinder, box, ellipsoid or mesh"
                raise SceneError(where, "type", geom.kind, wanted)
        _refuse_unless_sized(where, geom.kind, max(2 * rod.radius for rod in rods), _size(arm))
        out.add(geom.frame, geom.body, rigid_inverse(rest[geom.frame]) @ geom.place, rods)
    _finish(out, chain, arm)
    return out


def _finish(out: Covered, chain: Chain, arm: ArmDescription) -> None:
    """Raise if no link has a shape; ignore pairs of links whose covers always overlap, and note them."""
    if not out.links:
        raise SceneError(
            chain.source, "collision", None,
            "a robot whose links have collision shapes; else Body.bones, or --body 90,80 (radii in mm)",
        )  # fmt: skip
    out.ignore = always_touching(out, arm)
    if out.ignore:
        pairs = ", ".join(f"{one} and {other}" for one, other in out.ignore)
        out.notes.append(f"not tested against each other, since their covers overlap in all of {_POSTURES} "
                         f"random configurations, which is sampled, not proven: {pairs}")  # fmt: skip


def always_touching(covered: Covered, arm: ArmDescription) -> list[tuple[str, str]]:
    """Return pairs of links, not neighbours, whose covers overlap in all of many random configurations."""
    lower = np.maximum(np.array(arm.lower), -np.pi)
    upper = np.minimum(np.array(arm.upper), np.pi)
    rng = np.random.default_rng(_SEED)
    found: set[tuple[str, str]] | None = None
    for q in rng.uniform(lower, upper, (_POSTURES, JOINTS)):
        frames = link_frames(arm, q)
        meeting = set[tuple[str, str]]()
        placed = [
            (frame, link, frames[frame][:3, :3] @ np.stack([rod.begin, rod.end], axis=1)
             + frames[frame][:3, 3:], rod.radius)
            for frame, rods in covered.links.items() for link, rod in rods
        ]  # fmt: skip
        for i, (frame, link, ends, radius) in enumerate(placed):
            for other_frame, other, other_ends, other_radius in placed[:i]:
                if abs(frame - other_frame) > 1 and (found is None or (other, link) in found):
                    near = _segments_apart(ends.T, other_ends.T) < radius + other_radius
                    meeting |= {(other, link)} if near else set()
        found = meeting
        if not found:
            return []
    return sorted(found or ())


def _segments_apart(one: Floats, other: Floats) -> float:
    """Return the distance (m) of two segments (2, 3), or slightly more: it tries points of the first."""
    points = one[0] + np.linspace(0, 1, 33)[:, None] * (one[1] - one[0])
    return float(Rod(other[0], other[1], 0.0).distances(points).min())
