"""A scene made ready for one arm: everything in arrays, once; and the names behind the core's numbers."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from .. import _core
from .._arrays import Floats
from .._core import Within
from ..errors import SceneError
from .body import Body
from .scene import Scene
from .shapes import Shape

LINKS_OF_A_PAIR = 256  # the core says a pair as obstacle * 256 + link
_AXES = {
    1: "axis 1 (its y axis)", 2: "axis 3 (its z axis)", 5: "axis 5 (its y axis)", 6: "axis 7 (its z axis)",
}  # fmt: skip


class Ready(NamedTuple):
    """What the core takes, and the names of obstacles and links by the numbers that it gives."""

    handle: _core.Scene
    obstacles: tuple[str, ...]
    links: tuple[str, ...]

    def pair(self, code: int) -> tuple[str, str] | None:
        """Return (obstacle, link) of a pair's number; None where there is none."""
        if code < 0:
            return None
        return self.obstacles[code // LINKS_OF_A_PAIR], self.links[code % LINKS_OF_A_PAIR]


class _Link(NamedTuple):
    """A shape of the arm: the link it is of, its name, its row of numbers."""

    frame: int
    name: str
    row: list[float]


class Built(Protocol):
    """What is asked of an arm."""

    d_se: float
    d_ew: float
    a_3: float
    a_4: float
    d_4: float
    body: Body | None
    hand: tuple[Shape, ...]
    _handle: _core.Arm


def make_ready(arm: Built, scene: Scene) -> Ready:
    """Return a scene made ready for an arm, whose body or hand is what may touch it.

    Raises
    ------
    SceneError
        If the arm has neither, a link's shape is not where it can be treated, or a name is not known.
    """
    if not isinstance(scene, Scene):
        raise SceneError("scene", "scene", scene, "an armangle.Scene")
    if arm.body is None and not arm.hand:
        how = "arm.with_body(Body.bones(upper_arm=0.09, forearm=0.08))"
        raise SceneError("arm", "body", None, f"a body: {how}")
    parts, base, held = _sorted_links(arm)
    links = [*parts, *base, *held]
    for what, listed, most in (("parts of links 3 and 4", parts, _core.MOST_PARTS),
                               ("shapes of the arm", links, _core.MOST_LINKS)):  # fmt: skip
        if len(listed) > most:
            raise SceneError("arm", "body", len(listed), f"at most {most} {what}")
    obstacles = [*scene.names, *(link.name for link in [*base, *held])]
    user = [[*shape._row(), Within.USER.value] for shape in scene.shapes]
    solids = [*user, *(link.row for link in [*base, *held])]
    ignored = _ignored(scene, obstacles, links, [*base, *held])
    first_base = len(user)
    handle = _core.Scene(
        arm._handle,
        np.array(solids, dtype=np.float64).reshape(-1, _SOLID_WIDTH),
        first_base,
        first_base + len(base),
        np.array([_rod(link) for link in parts], dtype=np.float64).reshape(-1, _ROD_WIDTH),
        ignored,
        scene.clearance,
    )
    return Ready(handle, tuple(obstacles), tuple(link.name for link in links))


_SOLID_WIDTH, _ROD_WIDTH = 18, 8


def _rod(link: _Link) -> list[float]:
    """Return frame, radius, begin, end of a link's row."""
    return [link.frame, link.row[1], *link.row[2:8]]


def _sorted_links(arm: Built) -> tuple[list[_Link], list[_Link], list[_Link]]:
    """Return what turns with psi, what rests on the ground, and what moves with the pose alone.

    `frame` of the first is the link that a shape rests in; of the others the link that it was given for.
    """
    shapes = [] if arm.body is None else arm.body._shapes(arm.d_se, arm.d_ew, arm.a_3, arm.a_4, arm.d_4)
    rods: Floats = np.array([[frame, *shape._row()[1:8]] for frame, shape in shapes], dtype=np.float64)
    rods = rods.reshape(-1, _ROD_WIDTH)
    rest = np.zeros(len(rods), dtype=np.int64)
    arm._handle.resting_links(rods, rest)
    parts, base, held = [], [], []
    for (given, shape), at, rod in zip(shapes, rest.tolist(), rods.tolist(), strict=True):
        if at < 0:
            raise SceneError(
                f"Body link {given}", "center" if hasattr(shape, "center") else "begin, end",
                tuple(shape._row()[2:8]), f"a shape centred on {_AXES[given]}",
            )  # fmt: skip
        row = [*shape._row()[:2], *rod[2:], *shape._row()[8:]]
        name = shape.name or f"link_{given}"
        if at in (3, 4):
            parts.append(_Link(at, name, row))
        elif at == 0:
            base.append(_Link(given, name, [*row, Within.BASE.value]))
        else:
            held.append(_Link(given, name, [*row, Within.FLANGE.value]))
    held += [_Link(7, shape.name or "hand", [*shape._row(), Within.TOOL.value]) for shape in arm.hand]
    return parts, base, held


def _ignored(
    scene: Scene, obstacles: list[str], links: list[_Link], own: list[_Link]
) -> np.ndarray[tuple[int, int], np.dtype[np.int8]]:
    """Return which pairs may touch: those that the scene says, and own links side by side."""
    out = np.zeros((len(obstacles), len(links)), dtype=np.int8)
    names = [link.name for link in links]
    for at, (obstacle, link) in enumerate(scene.ignore):
        for what, name, known in (("an obstacle", obstacle, obstacles), ("a link", link, names)):
            if name not in known:
                listed = ", ".join(dict.fromkeys(known)) or "none"
                raise SceneError("Scene", f"ignore[{at}]", name, f"the name of {what} (there are: {listed})")
        rows = [i for i, name in enumerate(obstacles) if name == obstacle]
        out[np.ix_(rows, [i for i, name in enumerate(names) if name == link])] = 1
    first = len(scene.shapes)
    for i, mine in enumerate(own):
        for j, other in enumerate(links):
            out[first + i, j] |= abs(mine.frame - other.frame) <= 1
    return out
