"""Kinematic chains from MJCF, read with the ``mujoco`` package (extra ``mujoco``).

Bodies correspond to links, hinges to revolute joints; a site may be the tip. Shapes, meshes and actuators are
removed before the model is compiled: they may be missing, and cost time. :mod:`armangle.models.detect`
interprets the axes.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NoReturn
from xml.parsers import expat

import numpy as np

from ... import _opening
from ..._arrays import JOINTS, check_source
from ...errors import ModelError, needed
from ..axes import exceeds
from ..candidates import Candidate, RigidBody, Tree, TreeJoint, find_candidates, guess, moved_base, unknown
from ..chain import Chain, FloatArray, Joint, rotation_about, translation
from ..report import NOT_USED
from .bare import strip

_KINDS = ("free", "ball", "slide", "hinge")
_HINGE = 3
_PIECE = 4096


def is_mjcf(source: str | bytes | os.PathLike[str]) -> bool:
    """Return whether the outer element of a file or XML text is ``<mujoco>``; False if it cannot be read."""
    tags: list[str] = []
    parser = expat.ParserCreate()
    parser.StartElementHandler = lambda tag, _: tags.append(tag)
    try:
        if isinstance(source, bytes) or (isinstance(source, str) and source.lstrip().startswith("<")):
            parser.Parse(source.lstrip())
        else:
            with _opening.open_file(source, _opening.DESCRIPTION, partial(_refuse, str(source))) as file:
                while not tags and (piece := file.read(_PIECE)):
                    parser.Parse(piece)
    except (ModelError, OSError, LookupError, ValueError, TypeError, expat.ExpatError):
        pass  # the URDF reader reports the error
    return tags[:1] == ["mujoco"]


def _refuse(source: str, message: str) -> NoReturn:
    """Raise the error of a source."""
    raise ModelError(message, source=source)


class MjcfModel:
    """A compiled MuJoCo model without shapes, used for its tree alone.

    `source` is a file, or the XML text itself (a str that begins with ``<``). Raises `MissingExtraError`
    without the ``mujoco`` package, `ModelError` if the model cannot be read.
    """

    def __init__(self, source: str | os.PathLike[str]) -> None:
        """Compile the model of a file or of XML text."""
        self.mujoco: Any = needed("mujoco", "reading MJCF needs", "mujoco")
        check_source(source)
        text = isinstance(source, str) and source.lstrip().startswith("<")
        self.source = "XML text" if text else str(source)
        if not text:
            _opening.check_file(source, _opening.DESCRIPTION, self.fail)
        load = getattr(self.mujoco.MjSpec, "from_string" if text else "from_file")
        try:
            spec: Any = load(str(source))
            self.unused = strip(spec, self.mujoco)
            self.model: Any = spec.compile()
        except ValueError as error:
            self.fail(f"mujoco refuses it: {str(error).strip()}")

    def fail(self, message: str) -> NoReturn:
        """Raise an error with the source of the model."""
        _refuse(self.source, message)

    def name(self, kind: str, index: int) -> str:
        """Return the name of a body, joint or site; such as "body_3" if it has none."""
        return str(getattr(self.model, kind)(index).name) or f"{kind}_{index}"

    def find(self, kind: str, name: str) -> int | None:
        """Return the index of a name among ``body`` or ``site``; None if there is no such name."""
        count = {"body": self.model.nbody, "site": self.model.nsite}[kind]
        return next((i for i in range(count) if self.name(kind, i) == name), None)

    def body(self, name: str, role: str) -> int:
        """Return the index of a body; raise, with its role ("base", "tip"), if there is none."""
        found = self.find("body", name)
        if found is None:
            self.fail(unknown("body", name, role, [self.name("body", i) for i in range(self.model.nbody)]))
        return found

    def joints(self, body: int) -> range:
        """Return the indices of the joints that move a body in its parent."""
        first = int(self.model.body_jntadr[body])
        return range(first, first + int(self.model.body_jntnum[body]))

    def path(self, base: int, tip: int) -> list[int]:
        """Return the bodies from just below ``base`` down to ``tip``; raise if ``tip`` is not below it."""
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
        tree, body_of, held = Tree(), dict[int, int](), self.held()
        carried = [0] * self.model.nbody
        for body in range(1, self.model.nbody):
            carried[int(self.model.body_parentid[body])] += not self.joints(body)
        for body in range(self.model.nbody):
            under = body_of[int(self.model.body_parentid[body])] if body else None
            joints = self.joints(body)
            for joint in joints:
                tree.bodies.append(RigidBody())
                hinge, bound = int(self.model.jnt_type[joint]) == _HINGE, held.get(joint, "")
                above = under if under is not None and joint == joints[0] else len(tree.bodies) - 2
                ends = above, len(tree.bodies) - 1
                tree.joints.append(TreeJoint(self.name("joint", joint), hinge and not bound, *ends, bound))
            if not body:
                tree.bodies.append(RigidBody())
            body_of[body] = len(tree.bodies) - 1 if joints or under is None else under
            tree.bodies[body_of[body]].add(self.name("body", body), carried[body])
        return tree

    def held(self) -> dict[int, str]:
        """Return the index of each joint that an equality of the model keeps from moving freely, and why."""
        held = dict[int, str]()
        for joint, other in self.equalities(self.mujoco.mjtEq.mjEQ_JOINT):
            alone = "is held still by an equality"
            held[joint] = alone if other < 0 else f"is coupled to joint {self.name('joint', other)!r}"
        return held

    def equalities(self, kind: Any) -> Iterator[tuple[int, int]]:
        """Yield the indices of the two joints, or bodies, of each equality of a kind, if active at the start.

        For sites they are those of their bodies; -1 if there is no second.
        """
        model = self.model
        for number in np.flatnonzero((model.eq_type == kind) & (np.asarray(model.eq_active0) != 0)):
            ends = int(model.eq_obj1id[number]), int(model.eq_obj2id[number])
            of_sites = int(model.eq_objtype[number]) == int(self.mujoco.mjtObj.mjOBJ_SITE)
            yield (int(model.site_bodyid[ends[0]]), int(model.site_bodyid[ends[1]])) if of_sites else ends

    def notes(self, chain: Sequence[int]) -> Iterator[str]:
        """Yield notes on bounds of a chain's joints that the model has and this library does not use."""
        names = [self.name("joint", index) for index in chain]
        free = [name for name, index in zip(names, chain, strict=True)
                if not self.model.jnt_limited[index] and self.model.jnt_range[index].any()]  # fmt: skip
        if free:
            yield f"a range is stated, but limited is false, and so it is {NOT_USED}: joint {', '.join(free)}"
        servos = []
        for name, index in zip(names, chain, strict=True):
            low, high = self.unused.servos.get(name, (-math.inf, math.inf))
            limits = self.model.jnt_range[index] if self.model.jnt_limited[index] else (-math.inf, math.inf)
            if exceeds(low, limits[0]) or exceeds(limits[1], high):
                servos.append(f"{name!r} {low:.4g} to {high:.4g} rad")
        if servos:
            yield f"servos whose ctrlrange is narrower than the limits, {NOT_USED}: joint {', '.join(servos)}"
        tendons = [name or "without a name" for name, bound in self.unused.tendons
                   if bound is None or not bound.isdisjoint(names)]  # fmt: skip
        if tendons:
            yield f"limits and equalities of tendons are {NOT_USED}: {', '.join(tendons)}"
        for word in ("connect", "weld"):
            for ends in self.equalities(getattr(self.mujoco.mjtEq, f"mjEQ_{word.upper()}")):
                tied = [name for name, index in zip(names, chain, strict=True) if index in self.across(*ends)]
                if tied:
                    yield f"an equality ({word}) binds joint {', '.join(map(repr, tied))}: {NOT_USED}"

    def across(self, first: int, second: int) -> set[int]:
        """Return the joints between two bodies, on the way through their nearest common ancestor."""
        ways = [
            {joint for body in self.path(0, end) for joint in self.joints(body)} for end in (first, second)
        ]
        return ways[0] ^ ways[1]

    def between(self, base: str, tip: str) -> Chain:
        """Return the chain of any number of hinges from a body down to a body or site; raise if none."""
        start = self.body(base, "base")
        site = None if self.find("body", tip) is not None else self.find("site", tip)
        end = self.body(tip, "tip") if site is None else int(self.model.site_bodyid[site])
        frame, joints, held = np.eye(4), list[Joint](), self.held()
        for body in self.path(start, end):
            frame = frame @ frame_of(self.model.body_pos[body], self.model.body_quat[body])
            for index in self.joints(body):
                if index in held:
                    self.fail(f"joint {self.name('joint', index)!r} on the path {held[index]}")
                joints.append(self.hinge(index, frame))
                frame = translation(-self.model.jnt_pos[index])
        if site is not None:
            frame = frame @ frame_of(self.model.site_pos[site], self.model.site_quat[site])
        name = self.model.names.split(b"\0", 1)[0].decode() or "arm"
        hinges = [index for body in self.path(start, end) for index in self.joints(body)]
        return Chain(name, base, tip, tuple(joints), frame, self.source, tuple(self.notes(hinges)))

    def candidates(self, base: str | None = None) -> list[Candidate]:
        """Return every chain of seven hinges between bodies, S-R-S first; with ``base`` those from there."""
        if base is not None:
            self.body(base, "base")
        return find_candidates(self.tree(), self.between, base)

    def chain(self, base: str | None = None, tip: str | None = None, *, offset: bool = False) -> Chain:
        """Return the chain of seven hinges from a body to a body or site below it, in the model's frames and
        joints.

        Missing names are guessed: for a tip the seven hinges above it, else the only chain of seven, or the
        only S-R-S one of several, as `candidates` lists them; with `offset` the only one with an offset wrist
        or shoulder. MJCF has no joint velocities. Raises `ModelError` if the model has no such body, or no
        seven hinges between.
        """
        guessed: tuple[str, ...] = ()
        if base is not None:
            self.body(base, "base")
        if tip is None:
            base, tip, guessed = guess(self.tree(), self.between, base, None, self.fail, offset=offset)
        elif base is None:
            base = guess(self.tree(), self.between, None, self.body_above(tip), self.fail)[0]
        chain = self.between(base, tip)
        if len(chain.joints) != JOINTS:
            names = ", ".join(joint.name for joint in chain.joints) or "none"
            instead = self.tree().instead_of(base, self.body_above(tip))
            found = f"{len(chain.joints)} hinges from {base!r} to {tip!r}"
            self.fail(f"{found}, wanted {JOINTS}: {names}{instead}")
        lift = self.lift(self.body(base, "base"))
        moved = () if lift is None else (moved_base(lift, base),)
        return replace(chain, notes=(*guessed, *chain.notes, *moved))

    def lift(self, body: int) -> str | None:
        """Return the name of the nearest joint at or above a body; None if the body is fixed."""
        while body and not self.joints(body):
            body = int(self.model.body_parentid[body])
        joints = self.joints(body)
        return self.name("joint", joints[-1]) if joints else None

    def body_above(self, tip: str) -> str:
        """Return the name of the tip body, or of the body of a tip site."""
        site = None if self.find("body", tip) is not None else self.find("site", tip)
        above = tip if site is None else self.name("body", int(self.model.site_bodyid[site]))
        self.body(above, "tip")
        return above

    def hinge(self, index: int, frame: FloatArray) -> Joint:
        """Return a hinge, given the frame of its body in that of the joint before it; raise for other joints.

        Limits that the model lacks are infinite.
        """
        model = self.model
        name = self.name("joint", index)
        kind = int(model.jnt_type[index])
        if kind != _HINGE:
            self.fail(f"joint {name!r} on the path is {_KINDS[kind]}, wanted hinge")
        axis = np.array(model.jnt_axis[index], dtype=np.float64)
        back = rotation_about(axis, -np.float64(model.qpos0[model.jnt_qposadr[index]]))
        limited = bool(model.jnt_limited[index])
        lower, upper = model.jnt_range[index] if limited else (-np.inf, np.inf)
        origin = frame @ translation(model.jnt_pos[index]) @ back
        return Joint(name, origin, axis, float(lower), float(upper))


def frame_of(position: FloatArray, quaternion: FloatArray) -> FloatArray:
    """Return the frame (4, 4) of a translation (3,), m, and a unit quaternion (w, x, y, z)."""
    sine = float(np.linalg.norm(quaternion[1:]))
    axis = quaternion[1:] / sine if sine else np.array([0.0, 0.0, 1.0])
    angle = np.float64(2.0 * np.arctan2(sine, quaternion[0]))
    return np.asarray(translation(position) @ rotation_about(axis, angle), dtype=np.float64)
