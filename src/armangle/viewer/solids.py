"""Solids of the arm: capsules for its links, each rigid in one DH frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .._arrays import JOINTS, Floats
from ..arm.arm import Arm
from ..arm.skeleton import corners
from ..scenes.shapes import Capsule
from .surfaces import surface

# Names between neighbouring corners of the arm, the DH frame in which both ends are rigid, and the thickness.
_LINKS = (
    ("base", 0, 0.062), ("upper_arm", 3, 0.055), ("elbow_in", 3, 0.05), ("elbow_out", 4, 0.05),
    ("forearm", 4, 0.047), ("hand", 7, 0.04), ("tool", 7, 0.02),
)  # fmt: skip
_SHOULDER, _WRIST = ("shoulder", 1, 0.06), ("wrist", 6, 0.044)
_SHORT = 1e-6

GREY, DARK = (196, 200, 205), (120, 125, 132)


@dataclass(frozen=True, eq=False)
class Solid:
    """A triangle mesh in one DH frame.

    `name`, unique among the solids of an arm; `frame` 0..7 in which it is rigid; `vertices` (V, 3), m, in
    that frame; `faces` (F, 3); `colour`, RGB, 0..255.
    """

    name: str
    frame: int
    vertices: Floats
    faces: Any
    colour: tuple[int, int, int]


def capsules(arm: Arm, *, skip: frozenset[int] = frozenset()) -> list[Solid]:
    """Return the links as capsules, without those of no length and of the DH frames (0..7) in `skip`."""
    q = np.zeros(JOINTS)
    points, frames = corners(arm, q), arm.frames(q)
    size = arm.geometry.reach
    solids = []
    for k, (name, frame, thickness) in enumerate(_links(arm)):
        local = (points[k : k + 2] - frames[frame, :3, 3]) @ frames[frame, :3, :3]
        if np.linalg.norm(local[1] - local[0]) <= _SHORT * size or frame in skip:
            continue
        vertices, faces = surface(Capsule(local[0], local[1], thickness * size), size)
        solids.append(Solid(name, frame, vertices, faces, DARK if k % 2 else GREY))
    return solids


def _links(arm: Arm) -> list[tuple[str, int, float]]:
    """Return name, DH frame and radius (of the reach) of the link between each two neighbouring corners."""
    links = list(_LINKS)
    if arm.geometry.a_1:
        links.insert(1, _SHOULDER)
    if arm.geometry.a_6:
        links.insert(5, _WRIST)
    return links
