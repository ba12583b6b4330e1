"""A scene prepared for one arm: all data in arrays, and the names for the core's numbers."""

from __future__ import annotations

import warnings
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from .. import _core
from .._arrays import JOINTS, MILLIMETRES, Floats, Ints
from .._core import Within
from ..errors import SceneError
from .scene import Pairs, Scene, no_scene
from .shapes import Cloud, Field, Hull, Shape

_CELLS = 400_000  # of joint ranges, shared by own pairs: some hundredths of a second
TOO_FAR = 4.0  # arm lengths: a larger clearance was meant in mm
TOO_LARGE = 10.0  # arm lengths: a larger shape was meant in mm
LINKS_OF_A_PAIR = 256  # the core's number of a pair is obstacle * 256 + link


class PairNames(NamedTuple):
    """The names of obstacles and links for the core's numbers."""

    obstacles: tuple[str, ...]
    links: tuple[str, ...]

    def pair(self, code: int) -> tuple[str, str] | None:
        """Return (obstacle, link) of a pair's number; None without a pair."""
        if code < 0:
            return None
        return self.obstacles[code // LINKS_OF_A_PAIR], self.links[code % LINKS_OF_A_PAIR]


class Ready(NamedTuple):
    """The data for the core, and the names for its numbers.

    ``apart`` is a lower bound of the distance of own shapes (rows) and links (columns), m.
    """

    handle: _core.Scene
    names: PairNames
    apart: Floats


class _Link(NamedTuple):
    """A shape of the arm: its given link, the link with which it moves, its name, its row of numbers.

    ``place`` is its index among the body's shapes, -1 for a gripper's.
    """

    given: int
    frame: int
    name: str
    row: list[float]
    place: int


class _Links(NamedTuple):
    """Shapes of the arm by their motion: with the arm plane, none, with the pose, with a joint."""

    parts: list[_Link]
    base: list[_Link]
    held: list[_Link]
    swings: list[_Link]


class Lengths(Protocol):
    """Lengths of an arm, m, as in `Arm`."""

    @property
    def d_bs(self) -> float: ...
    @property
    def d_se(self) -> float: ...
    @property
    def d_ew(self) -> float: ...
    @property
    def d_wf(self) -> float: ...
    @property
    def a_3(self) -> float: ...
    @property
    def a_4(self) -> float: ...
    @property
    def d_4(self) -> float: ...


class Shaped(Protocol):
    """The functions that a collision model must have."""

    @property
    def ignore(self) -> Pairs:
        """Pairs of links that may touch."""

    def _shapes(self, lengths: Lengths) -> list[tuple[int, Shape]]: ...


class Built(Protocol):
    """The functions that an arm must have."""

    hand: tuple[Shape, ...]
    scene: Scene | None
    _handle: _core.Arm
    _ready: Ready | None
    _apart: Floats | None

    @property
    def geometry(self) -> Lengths:
        """Its lengths."""

    @property
    def body(self) -> Shaped | None:
        """The collision model of its links, or None."""


def make_ready(arm: Built, scene: Scene, last: Ready | None = None) -> Ready:
    """Return a scene prepared for an arm that has a collision model or a gripper.

    `last` is another scene prepared for the same arm. Its data of own links, or those that the arm keeps, are
    reused. Raises `SceneError` if the arm has neither, or too many shapes, a name is unknown, or lengths were
    meant in mm.
    """
    if not isinstance(scene, Scene):
        raise no_scene(scene, "an armangle.Scene")
    if arm.body is None and not arm.hand:
        how = "arm.with_(body=Body.bones(upper_arm=0.09, forearm=0.08))"
        raise SceneError("arm", "body", None, f"a body: {how}")
    _refuse_millimetres(arm, scene)
    mine = _sorted_links(arm)
    links = [*mine.parts, *mine.base, *mine.held, *mine.swings]
    turning = [*mine.swings, *mine.parts]
    for what, listed, most in (("shapes of links 1 to 6", turning, _core.MOST_PARTS),
                               ("shapes of the arm", links, _core.MOST_LINKS)):  # fmt: skip
        if len(listed) > most:
            raise SceneError("arm", "body", len(listed), f"at most {most} {what}")
    own = [*mine.base, *mine.held, *turning]
    obstacles = [*scene.names, *(link.name for link in own)]
    within = (Within.POINTS if isinstance(shape, Cloud) else Within.USER for shape in scene.shapes)
    user = [[*shape._row(), where.value] for shape, where in zip(scene.shapes, within, strict=True)]
    solids = [*user, *(link.row for link in [*mine.base, *mine.held])]
    ignored = _ignored(scene, obstacles, links, own)
    for pair in () if arm.body is None else arm.body.ignore:
        _let_touch(ignored, len(scene.shapes), own, links, pair)
    first_base = len(user)
    first_held = first_base + len(mine.base)
    known = arm._apart if last is None else last.apart
    apart = _never_nearer(arm, own, links) if known is None else known
    fields = [(at, shape) for at, shape in enumerate(scene.shapes) if isinstance(shape, Field)]
    handle = _core.Scene(
        arm._handle,
        np.array(solids, dtype=np.float64).reshape(-1, _SOLID_WIDTH),
        first_base,
        first_held,
        _points(scene),
        _corners(scene.shapes, arm.hand, first_held + len(mine.held) - len(arm.hand)),
        np.array([[at, *f.distance.shape, f.spacing] for at, f in fields]).reshape(-1, _FIELD_WIDTH),
        np.concatenate([f.distance.ravel() for _, f in fields] or [np.empty(0)]),
        np.array([_rod(link) for link in [*mine.parts, *mine.swings]], dtype=np.float64).reshape(
            -1, _ROD_WIDTH
        ),
        ignored,
        apart,
        _own_pairs(mine, first_held + len(mine.held), ignored),
        scene.clearance,
        scene.soft,
    )
    names = PairNames(tuple(obstacles), tuple(link.name for link in links))
    if isinstance(arm._handle, _core.Arm) and last is None:  # once an arm; a plan uses wider scenes
        code, most = handle.always_near(arm._handle)
        _warn_of_always_near(names.pair(code), most)
    return Ready(handle, names, apart)


def _warn_of_always_near(pair: tuple[str, str] | None, most: float) -> None:
    """Warn of two own links that are in every configuration nearer than the clearance: at most `most` (m)."""
    if pair is None:
        return
    apart = f"overlap by at least {-most * MILLIMETRES:.3g} mm"
    if most >= 0:
        apart = f"are never more than {most * MILLIMETRES:.3g} mm apart"
    warnings.warn(
        f"{pair[0]} and {pair[1]} of this arm {apart}, in every configuration, so no arm angle is "
        f"collision-free: make their shapes smaller, or let them touch by Scene(..., ignore=[{pair}])",
        UserWarning,
        stacklevel=3,
    )


def _refuse_millimetres(arm: Built, scene: Scene) -> None:
    """Raise for shapes or a clearance that are so large for this arm that they were meant in mm."""
    length = arm.geometry.d_bs + arm.geometry.d_se + arm.geometry.d_ew + arm.geometry.d_wf
    named = [*zip(scene.names, scene.shapes, strict=True), *((s.name or "hand", s) for s in arm.hand)]
    for name, shape in named:
        thick = shape._thickness()
        if thick > TOO_LARGE * length:
            wanted = f"at most {TOO_LARGE * length:.3g} m, {TOO_LARGE:g} lengths of the arm: was this in mm?"
            raise SceneError(name, "thickness", thick, wanted)
    for what, kept, most in (
        ("clearance", scene.clearance, TOO_FAR * length),
        ("soft", scene.soft, TOO_LARGE * length),
    ):
        if kept > most:
            raise SceneError("Scene", what, kept, f"at most {most:.3g} m for such an arm: was this in mm?")


_SOLID_WIDTH, _ROD_WIDTH, _POINT_WIDTH, _CORNER_WIDTH, _FIELD_WIDTH = 18, 8, 5, 4, 5


def _points(scene: Scene) -> Floats:
    """Return the points of all clouds, (N, 5): x, y, z, radius (m), index of the cloud among all shapes."""
    clouds = [(at, shape) for at, shape in enumerate(scene.shapes) if isinstance(shape, Cloud)]
    out = np.empty((sum(len(cloud.points) for _, cloud in clouds), _POINT_WIDTH))
    first = 0
    for at, cloud in clouds:
        rows = out[first : first + len(cloud.points)]
        rows[:, :3], rows[:, 3], rows[:, 4] = cloud.points, cloud.radius, at
        first += len(rows)
    return out


def _corners(shapes: tuple[Shape, ...], hand: tuple[Shape, ...], first_of_hand: int) -> Floats:
    """Return the corners of all hulls: index (the gripper's from `first_of_hand`), then x, y, z (m)."""
    rows = [*enumerate(shapes), *enumerate(hand, start=first_of_hand)]
    hulls = [(at, shape._corners()) for at, shape in rows if isinstance(shape, Hull)]
    parts = [np.column_stack([np.full(len(corners), at), corners]) for at, corners in hulls]
    return np.concatenate([*parts, np.empty((0, _CORNER_WIDTH))])


def _rod(link: _Link) -> list[float]:
    """Return a link's capsule as numbers: its frame, radius (m), and both ends (m)."""
    return [link.frame, link.row[1], *link.row[2:8]]


def _sorted_links(arm: Built) -> _Links:
    """Return the arm's shapes, sorted by how they move with arm angle, pose and joints."""
    shapes = [] if arm.body is None else arm.body._shapes(arm.geometry)
    rods: Floats = np.array([[frame, *shape._row()[1:8]] for frame, shape in shapes], dtype=np.float64)
    rods = rods.reshape(-1, _ROD_WIDTH)
    rest = np.zeros(len(rods), dtype=np.int64)
    arm._handle.resting_links(rods, rest)
    out = _Links([], [], [], [])
    for place, ((given, shape), at, rod) in enumerate(zip(shapes, rest.tolist(), rods.tolist(), strict=True)):
        row = [*shape._row()[:2], *rod[2:], *shape._row()[8:]]
        name = shape.name or f"link_{given}"
        if at < 0:
            out.swings.append(_Link(given, given, name, row, place))
        elif at in (3, 4):
            out.parts.append(_Link(given, at, name, row, place))
        elif at == 0:
            out.base.append(_Link(given, at, name, [*row, Within.BASE.value], place))
        else:
            out.held.append(_Link(given, at, name, [*row, Within.FLANGE.value], place))
    tool = [_Link(JOINTS, JOINTS, s.name or "hand", [*s._row(), Within.TOOL.value], -1) for s in arm.hand]
    out.held.extend(tool)
    return out


def _own_pairs(mine: _Links, first_obstacle: int, ignored: NDArray[np.int8]) -> Ints:
    """Return the pairs (obstacle, link) of the arm's own shapes, links 1 to 6, that must not touch."""
    turning = [*mine.swings, *mine.parts]
    first_swing = len(mine.parts) + len(mine.base) + len(mine.held)
    places = [*range(first_swing, first_swing + len(mine.swings)), *range(len(mine.parts))]
    pairs = [
        (first_obstacle + i, places[j])
        for i in range(len(turning))
        for j in range(i + 1, len(turning))
        if not ignored[first_obstacle + i, places[j]]
    ]
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def never_nearer(arm: Built) -> tuple[list[tuple[int, Shape]], Floats]:
    """Return the n shapes of a body with their DH frames, and lower bounds of their distances, m (n, n).

    For all joints, ignoring limits. -inf for neighbours, for pairs that touch at some joints, and for pairs
    without a proof at a fixed effort; for an arm that is not exactly S-R-S always.
    """
    shapes = [] if arm.body is None else arm.body._shapes(arm.geometry)
    out = np.full((len(shapes), len(shapes)), -np.inf)
    if isinstance(arm._handle, _core.Arm) and shapes:
        order = np.argsort([frame for frame, _ in shapes], kind="stable")
        rods: Floats = np.array([[shapes[k][0], *shapes[k][1]._row()[1:8]] for k in order], dtype=np.float64)
        found = np.empty_like(out)
        arm._handle.never_nearer_all(rods, found, _CELLS)
        out[np.ix_(order, order)] = np.maximum(found, found.T)
    return shapes, out


class LinkPair(NamedTuple):
    """Two links of an arm that are not neighbours, and their known distance.

    ``apart`` is a lower bound of their distance for all joints, m; None without a proof. ``ignored``: the
    collision model excludes this pair.
    """

    links: tuple[str, str]
    apart: float | None
    ignored: bool


def link_pairs(arm: Built) -> list[LinkPair]:
    """Return all pairs of links of an arm's collision model except neighbours."""
    shapes, found = never_nearer(arm)
    least: dict[tuple[str, str], float] = {}
    for i, (frame, shape) in enumerate(shapes):
        for j, (other_frame, other) in enumerate(shapes[:i]):
            if abs(frame - other_frame) > 1:
                pair = (other.name or f"link_{other_frame}", shape.name or f"link_{frame}")
                least[pair] = min(least.get(pair, np.inf), float(found[i, j]))
    ignored = set() if arm.body is None else {frozenset(pair) for pair in arm.body.ignore}
    return [
        LinkPair(pair, apart if apart > 0 else None, frozenset(pair) in ignored)
        for pair, apart in least.items()
    ]


def _never_nearer(arm: Built, own: list[_Link], links: list[_Link]) -> Floats:
    """Return lower bounds (m) of the distance of own shapes (rows) to links (columns); -inf for a gripper."""
    _, found = never_nearer(arm)
    out = np.full((len(own), len(links)), -np.inf)
    for i, mine in enumerate(own):
        for j, other in enumerate(links):
            if mine.place >= 0 and other.place >= 0:
                out[i, j] = found[mine.place, other.place]
    return out


def _let_touch(
    ignored: NDArray[np.int8], first: int, own: list[_Link], links: list[_Link], pair: tuple[str, str]
) -> None:
    """Mark a pair of own links as permitted to touch, in both orders; own shapes begin at row `first`."""
    for one, other in (pair, pair[::-1]):
        rows = [first + i for i, link in enumerate(own) if link.name == one]
        ignored[np.ix_(rows, [i for i, link in enumerate(links) if link.name == other])] = 1


def _ignored(scene: Scene, obstacles: list[str], links: list[_Link], own: list[_Link]) -> NDArray[np.int8]:
    """Return for each obstacle and link whether they may touch, by the scene or as neighbours."""
    out = np.zeros((len(obstacles), len(links)), dtype=np.int8)
    names = [link.name for link in links]
    for at, (obstacle, link) in enumerate(scene.ignore):
        for what, name, known in (("an obstacle", obstacle, obstacles), ("a link", link, names)):
            if name not in known:
                listed = ", ".join(dict.fromkeys(known)) or "none"
                raise SceneError("Scene", f"ignore[{at}]", name, f"the name of {what} (there are: {listed})")
        rows = [i for i, name in enumerate(obstacles) if name == obstacle]
        out[np.ix_(rows, [i for i, name in enumerate(names) if name == link])] = 1
        _let_touch(out, len(scene.shapes), own, links, (obstacle, link))
    first = len(scene.shapes)
    for i, mine in enumerate(own):
        for j, other in enumerate(links):
            out[first + i, j] |= abs(mine.given - other.given) <= 1
    return out
