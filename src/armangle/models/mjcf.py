"""Kinematic chains from MJCF, read with the ``mujoco`` package (extra ``mujoco``).

Bodies take the place of links, hinges that of revolute joints; a site may be the tip. Shapes, meshes and
actuators are taken out before the model is compiled: they need not be there, and take their time. What the
axes mean is the business of :mod:`armangle.models.detect`.
"""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from .._arrays import JOINTS, check_source
from ..errors import FileFormatError, SceneError, needed
from .candidates import Candidate, RigidBody, Tree, TreeJoint, find_candidates, guess, moved_base, unknown
from .chain import Chain, FloatArray, Joint, rotation_about, translation

_KINDS = ("free", "ball", "slide", "hinge")
_HINGE = 3
_PIECE = 4096
_SHAPES = (
    "actuators", "sensors", "keys", "tendons", "pairs", "excludes", "tuples", "skins",
    "flexes", "geoms", "cameras", "lights", "meshes", "hfields", "materials", "textures", "plugins",
)  # fmt: skip
_COLLIDING = ("plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf")
_LEAST_MASS = 1e-3  # kg, and kg m^2: bodies whose mass came from their shapes


def read_mjcf(
    source: str | os.PathLike[str], base: str | None = None, tip: str | None = None, *, offset: bool = False
) -> Chain:
    """Return the chain of seven hinges from a body to a body or site.

    Parameters
    ----------
    source : str or path
        A file, or the XML text itself (a str that begins with ``<``).
    base : str, optional
        Name of a body.
    tip : str, optional
        Name of a body or site below ``base``. What is left out is guessed: the only chain of seven hinges,
        or the only one of several that is S-R-S. :func:`mjcf_candidates` lists the choices.
    offset : bool, optional
        Guess an arm with an offset wrist or shoulder, in place of one that is S-R-S.

    Returns
    -------
    Chain
        In the frames and joint coordinates of the model. MJCF has no joint speeds.

    Raises
    ------
    MissingExtraError
        Without the ``mujoco`` package.
    FileFormatError
        The model cannot be read, has no such body, or no seven hinges between.
    """
    return _Model(source).chain(base, tip, offset)


def mjcf_candidates(source: str | os.PathLike[str], base: str | None = None) -> list[Candidate]:
    """Return every chain of seven hinges between bodies, S-R-S first; with ``base`` only those from there."""
    model = _Model(source)
    if base is not None:
        model.body(base, "base")
    return find_candidates(model.tree(), model.between, base)


def is_mjcf(path: str | os.PathLike[str]) -> bool:
    """Return whether a file is a MuJoCo model: its outer element is ``<mujoco>``."""
    tags: list[str] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda tag, _: tags.append(tag)
    try:
        with Path(path).open("rb") as file:
            while not tags and (piece := file.read(_PIECE)):
                parser.Parse(piece)
    except (OSError, ValueError, LookupError, expat.ExpatError):
        return False  # who reads it as URDF says what is wrong
    return tags[:1] == ["mujoco"]


class PlacedGeom(NamedTuple):
    """One geom: its body, the DH frame 0..7 that carries it, its pose in the base, its kind and size (m)."""

    name: str
    body: str
    frame: int
    place: FloatArray
    kind: str
    size: tuple[float, ...]
    vertices: FloatArray
    faces: NDArray[np.int64]


def mjcf_geoms(
    source: str | os.PathLike[str], base: str | None = None, tip: str | None = None
) -> tuple[Chain, FloatArray, list[PlacedGeom], list[str]]:
    """Return a chain, its joints (7,) at the model's reference position, geoms that collide, and notes.

    Geoms of bodies that move with the base or with one of the seven hinges alone, where the model is at its
    reference position; a mesh is its convex hull, as MuJoCo collides it.
    """
    chain = read_mjcf(source, base, tip)
    mujoco: Any = needed("mujoco", "reading MJCF needs", "mujoco")
    text = isinstance(source, str) and source.lstrip().startswith("<")
    try:
        load = getattr(mujoco.MjModel, "from_xml_string" if text else "from_xml_path")
        model = load(str(source))
    except ValueError as error:
        raise SceneError(chain.source, "geoms", str(error).strip(), "a model that mujoco compiles") from None
    moving = {joint.name: i + 1 for i, joint in enumerate(chain.joints)}
    start = next(i for i in range(model.nbody) if (model.body(i).name or f"body_{i}") == chain.base)
    frame_of: dict[int, int | None] = {start: 0}
    place_of = {start: np.eye(4)}
    left = []
    for body in range(start + 1, model.nbody):
        above = int(model.body_parentid[body])
        if frame_of.get(above) is None:
            continue
        place_of[body] = place_of[above] @ _frame(model.body_pos[body], model.body_quat[body])
        frame = frame_of[above]
        first = int(model.body_jntadr[body])
        for joint in range(first, first + int(model.body_jntnum[body])):
            frame = moving.get(model.joint(joint).name or f"joint_{joint}") if frame is not None else None
        frame_of[body] = frame
        if frame is None:
            left.append(model.body(body).name or f"body_{body}")
    kinds = {int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}")): kind for kind in _COLLIDING}
    geoms = []
    for geom in range(model.ngeom):
        frame = frame_of.get(int(model.geom_bodyid[geom]))
        if frame is None or not (model.geom_contype[geom] or model.geom_conaffinity[geom]):
            continue
        place = place_of[int(model.geom_bodyid[geom])] @ _frame(model.geom_pos[geom], model.geom_quat[geom])
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
    return chain, np.array(q), geoms, notes


_NO_FACES = np.empty((0, 3), dtype=np.int64)


def _hull(model: Any, mesh: int) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return corners and triangles of a mesh's convex hull, from the graph that MuJoCo keeps of it."""
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    vertices = np.array(model.mesh_vert[first : first + count], dtype=np.float64)
    at = int(model.mesh_graphadr[mesh])
    if at < 0:
        at = int(model.mesh_faceadr[mesh])
        return vertices, np.array(model.mesh_face[at : at + int(model.mesh_facenum[mesh])], dtype=np.int64)
    corners, faces = int(model.mesh_graph[at]), int(model.mesh_graph[at + 1])
    begin = at + 2 + 3 * corners + 3 * faces
    return vertices, np.array(model.mesh_graph[begin : begin + 3 * faces], dtype=np.int64).reshape(-1, 3)


class _Model:
    """A compiled MuJoCo model without shapes, asked for its tree alone."""

    def __init__(self, source: str | os.PathLike[str]) -> None:
        self.mujoco: Any = needed("mujoco", "reading MJCF needs", "mujoco")
        check_source(source)
        text = isinstance(source, str) and source.lstrip().startswith("<")
        self.source = "XML text" if text else str(source)
        if not text and not Path(source).is_file():
            self.fail("no such file")
        load = getattr(self.mujoco.MjSpec, "from_string" if text else "from_file")
        try:
            spec: Any = load(str(source))
            self.model: Any = _bare(spec, self.mujoco.mjtEq.mjEQ_JOINT).compile()
        except ValueError as error:
            self.fail(f"mujoco refuses it: {str(error).strip()}")

    def fail(self, message: str) -> NoReturn:
        raise FileFormatError(message, source=self.source)

    def name(self, kind: str, index: int) -> str:
        """Return the name of a body, joint or site; its number where it has none."""
        return str(getattr(self.model, kind)(index).name) or f"{kind}_{index}"

    def find(self, kind: str, name: str) -> int | None:
        """Return the index of a name among ``body`` or ``site``."""
        count = {"body": self.model.nbody, "site": self.model.nsite}[kind]
        return next((i for i in range(count) if self.name(kind, i) == name), None)

    def body(self, name: str, role: str) -> int:
        """Return the index of a body that must be there."""
        found = self.find("body", name)
        if found is None:
            self.fail(unknown("body", name, role, [self.name("body", i) for i in range(self.model.nbody)]))
        return found

    def joints(self, body: int) -> range:
        """Return the indices of the joints that move a body in its parent."""
        first = int(self.model.body_jntadr[body])
        return range(first, first + int(self.model.body_jntnum[body]))

    def path(self, base: int, tip: int) -> list[int]:
        """Return the bodies from just below ``base`` down to ``tip``."""
        way = []
        body = tip
        while body != base:
            if body == 0:
                ends = [self.name("body", index) for index in (base, tip)]
                self.fail(f"no path down from body {ends[0]!r} to {ends[1]!r}")
            way.append(body)
            body = int(self.model.body_parentid[body])
        return way[::-1]

    def tree(self) -> Tree:
        """Return the rigid bodies of the model and the joints between them."""
        tree, body_of, free = Tree(), dict[int, int](), set(range(self.model.njnt)) - self.coupled()
        carried = [0] * self.model.nbody
        for body in range(1, self.model.nbody):
            carried[int(self.model.body_parentid[body])] += not self.joints(body)
        for body in range(self.model.nbody):
            under = body_of[int(self.model.body_parentid[body])] if body else None
            joints = self.joints(body)
            for joint in joints:
                tree.bodies.append(RigidBody())
                rotates = joint in free and int(self.model.jnt_type[joint]) == _HINGE
                above = under if under is not None and joint == joints[0] else len(tree.bodies) - 2
                tree.joints.append(TreeJoint(self.name("joint", joint), rotates, above, len(tree.bodies) - 1))
            if not body:
                tree.bodies.append(RigidBody())
            body_of[body] = len(tree.bodies) - 1 if joints or under is None else under
            tree.bodies[body_of[body]].add(self.name("body", body), carried[body])
        return tree

    def coupled(self) -> set[int]:
        """Return the joints that an equality moves with another."""
        equal = self.model.eq_type == self.mujoco.mjtEq.mjEQ_JOINT
        return {int(joint) for joint in self.model.eq_obj1id[equal]}

    def between(self, base: str, tip: str) -> Chain:
        """Return the chain between two bodies, or a body and a site."""
        start = self.body(base, "base")
        site = None if self.find("body", tip) is not None else self.find("site", tip)
        end = self.body(tip, "tip") if site is None else int(self.model.site_bodyid[site])
        frame, joints = np.eye(4), list[Joint]()
        for body in self.path(start, end):
            frame = frame @ _frame(self.model.body_pos[body], self.model.body_quat[body])
            for index in self.joints(body):
                joints.append(self.hinge(index, frame))
                frame = translation(-self.model.jnt_pos[index])
        if site is not None:
            frame = frame @ _frame(self.model.site_pos[site], self.model.site_quat[site])
        name = self.model.names.split(b"\0", 1)[0].decode() or "arm"
        return Chain(name, base, tip, tuple(joints), frame, self.source)

    def chain(self, base: str | None, tip: str | None, offset: bool = False) -> Chain:
        """Return the chain of seven hinges from base to tip, the missing ones guessed."""
        if base is not None:
            self.body(base, "base")
        if tip is None:
            base, tip = guess(self.tree(), self.between, base, None, self.fail, offset=offset)
        elif base is None:
            base = self.tree().base_above(self.body_above(tip))
        chain = self.between(base, tip)
        if len(chain.joints) != JOINTS:
            names = ", ".join(joint.name for joint in chain.joints) or "none"
            instead = self.tree().instead_of(base, self.body_above(tip))
            found = f"{len(chain.joints)} hinges from {base!r} to {tip!r}"
            self.fail(f"{found}, wanted {JOINTS}: {names}{instead}")
        lift = self.lift(self.body(base, "base"))
        return chain if lift is None else replace(chain, notes=(*chain.notes, moved_base(lift, base)))

    def lift(self, body: int) -> str | None:
        """Return the name of the nearest joint that moves a body, None where it stands still."""
        while body and not self.joints(body):
            body = int(self.model.body_parentid[body])
        joints = self.joints(body)
        return self.name("joint", joints[-1]) if joints else None

    def body_above(self, tip: str) -> str:
        """Return the name of the body that a tip is, or is a site of."""
        site = None if self.find("body", tip) is not None else self.find("site", tip)
        above = tip if site is None else self.name("body", int(self.model.site_bodyid[site]))
        self.body(above, "tip")
        return above

    def hinge(self, index: int, frame: FloatArray) -> Joint:
        """Return a joint whose body sits at ``frame`` at the model's reference position."""
        model = self.model
        name = self.name("joint", index)
        kind = int(model.jnt_type[index])
        if kind != _HINGE:
            self.fail(f"joint {name!r} on the path is {_KINDS[kind]}, wanted hinge")
        if index in self.coupled():
            self.fail(f"joint {name!r} on the path is coupled to another joint")
        axis = np.array(model.jnt_axis[index], dtype=np.float64)
        back = rotation_about(axis, -np.float64(model.qpos0[model.jnt_qposadr[index]]))
        limited = bool(model.jnt_limited[index])
        lower, upper = model.jnt_range[index] if limited else (-np.inf, np.inf)
        origin = frame @ translation(model.jnt_pos[index]) @ back
        return Joint(name, origin, axis, float(lower), float(upper))


def _bare(spec: Any, joint_equality: Any) -> Any:
    """Return a specification freed of all that is no body, joint or site."""
    unwanted = [equality for equality in spec.equalities if equality.type != joint_equality]
    for kind in _SHAPES:
        unwanted += getattr(spec, kind)
    for element in unwanted:
        if hasattr(spec, "delete"):
            spec.delete(element)
        else:  # mujoco of early 2025
            element.delete()
    for site in spec.sites:
        site.material = ""
    spec.compiler.boundmass = max(spec.compiler.boundmass, _LEAST_MASS)
    spec.compiler.boundinertia = max(spec.compiler.boundinertia, _LEAST_MASS)
    spec.compiler.balanceinertia = True
    spec.compiler.fusestatic = False
    return spec


def _frame(position: FloatArray, quaternion: FloatArray) -> FloatArray:
    """Return the frame (4, 4) of a shift (3,), m, and a unit quaternion (w, x, y, z)."""
    sine = float(np.linalg.norm(quaternion[1:]))
    axis = quaternion[1:] / sine if sine else np.array([0.0, 0.0, 1.0])
    angle = np.float64(2.0 * np.arctan2(sine, quaternion[0]))
    return np.asarray(translation(position) @ rotation_about(axis, angle), dtype=np.float64)
