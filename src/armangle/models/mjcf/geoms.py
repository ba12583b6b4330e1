"""The geoms of a MuJoCo model: the DH frame that carries each, and its pose."""

from __future__ import annotations

import os
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import SceneError, needed
from ..chain import Chain, FloatArray
from .reading import frame_of

_COLLIDING = ("plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf")


class PlacedGeom(NamedTuple):
    """One geom: its body, the DH frame 0..7 that carries it, its pose in the base, kind, MuJoCo's size (m).

    `vertices` and `faces` are empty unless it is a mesh.
    """

    name: str
    body: str
    frame: int
    place: FloatArray
    kind: str
    size: tuple[float, ...]
    vertices: FloatArray
    faces: NDArray[np.int64]


def mjcf_geoms(
    source: str | os.PathLike[str], chain: Chain
) -> tuple[FloatArray, list[PlacedGeom], list[str]]:
    """Return a chain's joints (7,) at the model's reference position, colliding geoms, and notes.

    Geoms of bodies that move with the base or with one of the seven hinges alone, at the model's reference
    position; a mesh is its convex hull, as in MuJoCo's collisions.
    """
    mujoco: Any = needed("mujoco", "reading MJCF needs", "mujoco")
    text = isinstance(source, str) and source.lstrip().startswith("<")
    try:
        load = getattr(mujoco.MjModel, "from_xml_string" if text else "from_xml_path")
        model = load(str(source))
    except ValueError as error:
        raise SceneError(chain.source, "geoms", str(error).strip(), "a model that mujoco compiles") from None
    moving = {joint.name: i + 1 for i, joint in enumerate(chain.joints)}
    start = next(i for i in range(model.nbody) if (model.body(i).name or f"body_{i}") == chain.base)
    carried_by: dict[int, int | None] = {start: 0}
    place_of = {start: np.eye(4)}
    left = []
    for body in range(start + 1, model.nbody):
        above = int(model.body_parentid[body])
        if carried_by.get(above) is None:
            continue
        place_of[body] = place_of[above] @ frame_of(model.body_pos[body], model.body_quat[body])
        frame = carried_by[above]
        first = int(model.body_jntadr[body])
        for joint in range(first, first + int(model.body_jntnum[body])):
            frame = moving.get(model.joint(joint).name or f"joint_{joint}") if frame is not None else None
        carried_by[body] = frame
        if frame is None:
            left.append(model.body(body).name or f"body_{body}")
    kinds = {int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}")): kind for kind in _COLLIDING}
    geoms = []
    for geom in range(model.ngeom):
        frame = carried_by.get(int(model.geom_bodyid[geom]))
        if frame is None or not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue
        place = place_of[int(model.geom_bodyid[geom])] @ frame_of(model.geom_pos[geom], model.geom_quat[geom])
        kind = kinds.get(int(model.geom_type[geom]), "unknown")
        owner = int(model.geom_bodyid[geom])
        link = str(model.body(owner).name) or f"body_{owner}"
        shape = (
            _hull(model, int(model.geom_dataid[geom])) if kind == "mesh" else (np.empty((0, 3)), _NO_FACES)
        )
        name = model.geom(geom).name or f"geom_{geom}"
        size = tuple(float(x) for x in model.geom_size[geom])
        geoms.append(PlacedGeom(name, link, frame, place, kind, size, *shape))
    notes = [f"not covered, since they move by joints of their own: {', '.join(left)}"] if left else []
    q = [float(model.qpos0[model.joint(name).qposadr[0]]) for name in moving]
    return np.array(q), geoms, notes


_NO_FACES = np.empty((0, 3), dtype=np.int64)


def _hull(model: Any, mesh: int) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return vertices and triangles of a mesh's convex hull; its own triangles if MuJoCo stores no hull."""
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    vertices = np.array(model.mesh_vert[first : first + count], dtype=np.float64)
    at = int(model.mesh_graphadr[mesh])
    if at < 0:
        at = int(model.mesh_faceadr[mesh])
        return vertices, np.array(model.mesh_face[at : at + int(model.mesh_facenum[mesh])], dtype=np.int64)
    corners, faces = int(model.mesh_graph[at]), int(model.mesh_graph[at + 1])
    begin = at + 2 + 3 * corners + 3 * faces
    return vertices, np.array(model.mesh_graph[begin : begin + 3 * faces], dtype=np.int64).reshape(-1, 3)
