"""A scene: the obstacles around the arm."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import PurePath

from .. import _core
from .._values import fill
from ..errors import SceneError, Words
from .shapes import SHAPES, Shape, _length

Pairs = tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Scene:
    """Obstacles, in the frame that poses are given in.

    Parameters
    ----------
    shapes : sequence of Ball, Capsule, Box, HalfSpace, Hull, Cloud or Field
        Their names must differ; a shape without a name is called by its kind and index, such as "box_2".
    clearance : float
        Smallest permitted distance of links to all obstacles, m, >= 0.
    soft : float
        Additional distance beyond `clearance`, m, >= 0, that `step` and `follow` keep if the arm angle can,
        and `plan` if the whole path can. The policy of a step then acts on the arm angles with that distance.
        From arm angles between the two distances it moves there first, as fast as `max_joint_step` allows. If
        no arm angle has that distance, it has no effect.
    ignore : iterable of (str, str)
        Pairs (obstacle, link) that may touch, such as ("table", "link_0") for an arm mounted on its table.
        Whether they exist is checked when an arm gets the scene.

    Raises
    ------
    SceneError
        With the shape, the fault, and the permitted value.

    Examples
    --------
    >>> import armangle as aa
    >>> lamp = aa.Ball([0.4, 0, 0.5], 0.1, name="lamp")
    >>> scene = aa.Scene([lamp, aa.HalfSpace([0, 0, 1], 0)], clearance=0.02)
    >>> scene.names
    ('lamp', 'half_space_1')
    """

    shapes: tuple[Shape, ...]
    clearance: float
    ignore: Pairs
    soft: float

    def __init__(
        self,
        shapes: Sequence[Shape] = (),
        *,
        clearance: float = 0.0,
        soft: float = 0.0,
        ignore: Iterable[tuple[str, str]] = (),
    ) -> None:
        """Check shapes, clearances (m) and pairs to ignore."""
        listed = as_shapes("Scene", shapes, SHAPES)
        if len(listed) > _core.MOST_OBSTACLES:
            raise SceneError("Scene", "shapes", len(listed), f"at most {_core.MOST_OBSTACLES} shapes")
        fill(self, shapes=listed, clearance=_length("Scene", "clearance", clearance), ignore=as_pairs(ignore))
        fill(self, soft=_length("Scene", "soft", soft))
        names = self.names
        for at, name in enumerate(names):
            if name in names[:at]:
                raise SceneError(f"shapes[{at}]", "name", name, "a name that no other shape of the scene has")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the obstacles, in the order of the shapes."""
        return tuple(shape.name or f"{_word(shape)}_{at}" for at, shape in enumerate(self.shapes))


def no_scene(given: object, wanted: str, owner: str = "scene") -> SceneError:
    """Return the error for a value that is no scene, with a hint how to make one from it."""
    seen: object = given
    how = ""
    if isinstance(given, SHAPES):
        how = "; of shapes one is made by Scene([...])"
    elif isinstance(given, (str, PurePath)):
        how = "; of a file one is read by load_scene(...)"
    elif callable(given):
        seen, how = Words("a function"), "; follow and plan take functions of s"
    elif isinstance(given, Sequence) and given and isinstance(given[0], SHAPES):
        seen, how = Words(f"a {type(given).__name__} of shapes"), "; of shapes one is made by Scene([...])"
    elif isinstance(given, Sequence):
        seen, how = Words(f"a {type(given).__name__} of {len(given)}"), "; follow takes one for each pose"
    return SceneError(owner, "scene", seen, wanted + how)


def _word(shape: Shape) -> str:
    """Return the kind of a shape in lower case, such as half_space."""
    return "".join(f"_{c.lower()}" if c.isupper() else c for c in type(shape).__name__).lstrip("_")


def as_shapes(owner: str, shapes: Iterable[Shape], kinds: tuple[type, ...]) -> tuple[Shape, ...]:
    """Return shapes as a tuple, each of a permitted kind."""
    wanted = ", ".join(kind.__name__ for kind in kinds)
    if isinstance(shapes, (str, bytes)) or not isinstance(shapes, Iterable):
        raise SceneError(owner, "shapes", shapes, f"a sequence of {wanted}")
    listed = tuple(shapes)
    for at, shape in enumerate(listed):
        if not isinstance(shape, kinds):
            raise SceneError(owner, f"shapes[{at}]", shape, wanted)
    return listed


def as_pairs(
    ignore: Iterable[tuple[str, str]], owner: str = "Scene", wanted: str = "pairs of names (obstacle, link)"
) -> Pairs:
    """Return pairs of names as tuples; raise for anything else."""
    if isinstance(ignore, (str, bytes)) or not isinstance(ignore, Iterable):
        raise SceneError(owner, "ignore", ignore, wanted)
    pairs = []
    for at, pair in enumerate(ignore):
        if isinstance(pair, (str, bytes)) or not isinstance(pair, Sequence) or len(pair) != 2:
            raise SceneError(owner, f"ignore[{at}]", pair, wanted)
        if not all(isinstance(name, str) for name in pair):
            raise SceneError(owner, f"ignore[{at}]", pair, wanted)
        pairs.append((str(pair[0]), str(pair[1])))
    return tuple(pairs)
