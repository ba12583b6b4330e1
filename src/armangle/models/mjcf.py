"""Kinematic chains from MJCF, read with the ``mujoco`` package (extra ``mujoco``).

Bodies take the place of links, hinges that of revolute joints; a site may be the tip. What the
axes mean is the business of :mod:`armangle.models.detect`.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, NoReturn
from xml.parsers import expat

import numpy as np

from .._arrays import JOINTS
from ..errors import FileFormatError, needed
from .chain import Chain, FloatArray, Joint, rotation_about, translation

_KINDS = ("free", "ball", "slide", "hinge")
_HINGE = 3
_PIECE = 4096


def read_mjcf(source: str | os.PathLike[str], base: str | None = None, tip: str | None = None) -> Chain:
    """Return the chain of seven hinges from a body to a body or site.

    Parameters
    ----------
    source : str or path
        A file, or the XML text itself (a str that begins with ``<``).
    base : str, optional
        Name of a body; the world where left out.
    tip : str, optional
        Name of a body or site at or below ``base``; where left out, the one body that is reached
        through exactly seven hinges and carries no further fixed body.

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
    return _Model(source).chain(base, tip)


def mjcf_candidates(source: str | os.PathLike[str], base: str | None = None) -> tuple[tuple[str, str], ...]:
    """Return the pairs (base, tip) of bodies with exactly seven hinges between, in file order."""
    model = _Model(source)
    start = "world" if base is None else base
    return tuple((start, tip) for tip in model.tips(start))


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


class _Model:
    """A compiled MuJoCo model, asked for its tree alone."""

    def __init__(self, source: str | os.PathLike[str]) -> None:
        self.mujoco: Any = needed("mujoco", "reading MJCF needs", "mujoco")
        text = isinstance(source, str) and source.lstrip().startswith("<")
        self.source = "XML text" if text else str(source)
        if not text and not Path(source).is_file():
            self.fail("no such file")
        load = getattr(self.mujoco.MjModel, "from_xml_string" if text else "from_xml_path")
        try:
            self.model: Any = load(str(source))
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
            names = ", ".join(self.name("body", i) for i in range(self.model.nbody))
            self.fail(f"no body {name!r} ({role}); the bodies are: {names}")
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

    def tips(self, base: str) -> list[str]:
        """Return the bodies reached through exactly seven hinges and nothing else."""
        start = self.body(base, "base")
        hinges = {start: 0}
        for body in range(start + 1, self.model.nbody):
            above = hinges.get(int(self.model.body_parentid[body]))
            kinds = [int(self.model.jnt_type[joint]) for joint in self.joints(body)]
            if above is not None and all(kind == _HINGE for kind in kinds):
                hinges[body] = above + len(kinds)
        fixed = {int(self.model.body_parentid[b]) for b in hinges if b and not self.joints(b)}
        ends = [body for body, count in hinges.items() if count == JOINTS and body not in fixed]
        return [self.name("body", body) for body in ends]

    def guess(self, base: str) -> str:
        """Return the one tip that there is."""
        tips = self.tips(base)
        if len(tips) != 1:
            what = f"candidates: {', '.join(tips)}" if tips else "no body has seven hinges above it"
            self.fail(f"the tip under body {base!r} is not unique, name it; {what}")
        return tips[0]

    def chain(self, base: str | None, tip: str | None) -> Chain:
        first = "world" if base is None else base
        start = self.body(first, "base")
        last = self.guess(first) if tip is None else tip
        site = None if self.find("body", last) is not None else self.find("site", last)
        end = self.body(last, "tip") if site is None else int(self.model.site_bodyid[site])
        frame, joints = np.eye(4), list[Joint]()
        for body in self.path(start, end):
            frame = frame @ _frame(self.model.body_pos[body], self.model.body_quat[body])
            for index in self.joints(body):
                joints.append(self.hinge(index, frame))
                frame = translation(-self.model.jnt_pos[index])
        if len(joints) != JOINTS:
            names = ", ".join(joint.name for joint in joints) or "none"
            self.fail(f"{len(joints)} hinges from {first!r} to {last!r}, wanted {JOINTS}: {names}")
        if site is not None:
            frame = frame @ _frame(self.model.site_pos[site], self.model.site_quat[site])
        name = self.model.names.split(b"\0", 1)[0].decode() or "arm"
        return Chain(name, first, last, tuple(joints), frame, self.source)

    def hinge(self, index: int, frame: FloatArray) -> Joint:
        """Return a joint whose body sits at ``frame`` at the model's reference position."""
        model = self.model
        name = self.name("joint", index)
        kind = int(model.jnt_type[index])
        if kind != _HINGE:
            self.fail(f"joint {name!r} on the path is {_KINDS[kind]}, wanted hinge")
        coupled = model.eq_type == self.mujoco.mjtEq.mjEQ_JOINT
        if index in model.eq_obj1id[coupled]:
            self.fail(f"joint {name!r} on the path is coupled to another joint")
        axis = np.array(model.jnt_axis[index], dtype=np.float64)
        back = rotation_about(axis, -np.float64(model.qpos0[model.jnt_qposadr[index]]))
        limited = bool(model.jnt_limited[index])
        lower, upper = model.jnt_range[index] if limited else (-np.inf, np.inf)
        origin = frame @ translation(model.jnt_pos[index]) @ back
        return Joint(name, origin, axis, float(lower), float(upper))


def _frame(position: FloatArray, quaternion: FloatArray) -> FloatArray:
    """Return the frame (4, 4) of a shift (3,), m, and a unit quaternion (w, x, y, z)."""
    sine = float(np.linalg.norm(quaternion[1:]))
    axis = quaternion[1:] / sine if sine else np.array([0.0, 0.0, 1.0])
    angle = np.float64(2.0 * np.arctan2(sine, quaternion[0]))
    return np.asarray(translation(position) @ rotation_about(axis, angle), dtype=np.float64)
