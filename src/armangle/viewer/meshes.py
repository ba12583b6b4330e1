"""Solids from a URDF's visuals, each rigid in one DH frame; unreadable ones become capsules."""

from __future__ import annotations

import importlib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import JOINTS, Floats
from ..arm.arm import Arm
from ..models.urdf import UrdfModel
from ..models.urdf.shapes import mesh_file, numbers_of, origin_of, placed_elements
from .solids import DARK, GREY, Solid, capsules

# A capsule represents the links of these DH frames.
_GROUPS = {0: (0, 1), 3: (2, 3), 4: (4, 5), 7: (6, 7)}


@dataclass
class _Looks:
    """The visuals read from a file."""

    solids: list[Solid] = field(default_factory=list)
    failed: list[tuple[int, str]] = field(default_factory=list)


def solids_of(
    arm: Arm, urdf: Path | None = None, base: str | None = None, tip: str | None = None
) -> tuple[list[Solid], str]:
    """Return the solids for drawing an arm, and a sentence on unreadable parts, or "".

    `urdf` is the file from which the arm was read, `base` and `tip` the links given then; without it, or
    without visuals in it, links are capsules.
    """
    if urdf is None:
        return capsules(arm), ""
    looks = _visuals(arm, urdf, base, tip)
    broken = {frame for frame, _ in looks.failed}
    whole = {solid.frame for solid in looks.solids}
    shown = [f for f, links in _GROUPS.items() if whole & set(links) and not broken & set(links)]
    solids = looks.solids + capsules(arm, skip=frozenset(shown))
    if not looks.failed:
        return solids, ""
    what = "1 mesh is" if len(looks.failed) == 1 else f"{len(looks.failed)} meshes are"
    return solids, f"{what} drawn as capsules; the first: {looks.failed[0][1]}"


def _visuals(arm: Arm, urdf: Path, base: str | None, tip: str | None) -> _Looks:
    """Read the visuals of all links that move with one of the seven joints or with the base."""
    model = UrdfModel(urdf)  # rejects invalid XML, and entities
    chain = model.chain(base, tip)
    looks, seen = _Looks(), Counter[str]()
    for link, frame, local, visual in placed_elements(
        model.text, chain, arm.frames(np.zeros(JOINTS)), "visual"
    ):
        _read_visual(looks, visual, f"{link}_{seen[link]}", frame, local, urdf.parent)
        seen[link] += 1
    return looks


def _read_visual(looks: _Looks, visual: Any, name: str, frame: int, local: Floats, folder: Path) -> None:
    """Add one <visual> of a URDF to `looks`, or note why not; `local` is its link's frame in the DH frame."""
    try:
        shape = visual.find("geometry")[0]
        mesh = _shape(shape, folder)
        place = local @ origin_of(visual)
        vertices = np.asarray(mesh.vertices) @ place[:3, :3].T + place[:3, 3]
        faces = np.asarray(mesh.faces)
        if not len(faces) or not np.isfinite(vertices).all():
            raise ValueError("it holds no surface")
    except Exception as error:  # mesh readers raise many kinds of errors for broken files
        looks.failed.append((frame, f"{name}: {str(error) or type(error).__name__}"))
        return
    colour = GREY if frame % 2 == 0 else DARK
    looks.solids.append(Solid(name, frame, vertices, faces, _colour(visual, colour)))


def _shape(shape: Any, folder: Path) -> Any:
    """Return the trimesh of a URDF geometry: mesh, box, cylinder or sphere."""
    trimesh = importlib.import_module("trimesh")
    match shape.tag:
        case "mesh":
            mesh = trimesh.load(mesh_file(shape.get("filename", ""), folder), force="mesh")
            mesh.apply_scale(numbers_of(shape.get("scale"), 3, 1.0))
            return mesh
        case "box":
            return trimesh.creation.box(extents=numbers_of(shape.get("size"), 3, 0.0))
        case "cylinder":
            radius, length = float(shape.get("radius")), float(shape.get("length"))
            return trimesh.creation.cylinder(radius=radius, height=length)
        case "sphere":
            return trimesh.creation.icosphere(subdivisions=3, radius=float(shape.get("radius")))
    raise ValueError(f"unknown geometry <{shape.tag}>")


def _colour(visual: Any, default: tuple[int, int, int]) -> tuple[int, int, int]:
    """Return the RGB (0 to 255) of a visual's own material, or `default` without one."""
    colour = visual.find("material/color")
    if colour is None or colour.get("rgba") is None:
        return default
    rgba = np.clip(numbers_of(colour.get("rgba"), 4, 0.0), 0.0, 1.0)
    red, green, blue = (round(255 * float(part)) for part in rgba[:3])
    return red, green, blue
