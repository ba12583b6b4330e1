"""Scenes and collision models from files: TOML tables, and MoveIt's text of a planning scene."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any, NoReturn, TypeVar

import numpy as np

from .. import _opening
from .._arrays import Floats, PathLike, number_in
from ..errors import ArmangleError, SceneError, Words
from ..models.body import Body, as_shape
from ..models.cover import Rod, cover_cylinder, cover_mesh, merged, open_edges
from ..poses import pose
from ..scenes.scene import Scene
from ..scenes.shapes import Ball, Box, Capsule, HalfSpace, Hull, Shape
from .clouds import load_cloud
from .fields import load_field

_Made = TypeVar("_Made")

_KINDS: dict[str, tuple[Any, tuple[str, ...], tuple[str, ...]]] = {  # required keys, optional keys
    "ball": (Ball, ("center", "radius"), ("name",)),
    "capsule": (Capsule, ("begin", "end", "radius"), ("name",)),
    "box": (Box, ("size", "position"), ("rpy", "radius", "name")),
    "half_space": (HalfSpace, ("normal", "offset"), ("name",)),
    "hull": (Hull, (), ("points", "file", "radius", "name")),
    "cloud": (load_cloud, ("file", "radius"), ("name",)),
    "field": (load_field, ("file",), ("name",)),
}

_ROUND = 4  # rods for a round shape or a mesh of MoveIt


def load_scene(path: PathLike) -> Scene:
    """Return the scene of a TOML file, or of a ``.scene`` file saved by MoveIt.

    In TOML: ``clearance`` and ``soft`` (m), ``ignore`` (pairs of names), and any number of tables, lengths in
    m, each with an optional ``name``: ``[[ball]]`` (``center``, ``radius``), ``[[capsule]]`` (``begin``,
    ``end``, ``radius``), ``[[box]]`` (``size``, ``position``, and ``rpy`` in rad about fixed x, y, z,
    ``radius``), ``[[half_space]]`` (``normal``, ``offset``), ``[[hull]]`` (``points``, or a ``file`` of them
    as for `load_cloud`, ``radius``), ``[[cloud]]`` (``file``, as for `load_cloud`, ``radius``), ``[[field]]``
    (``file``, as for `load_field`). A file without tables is rejected unless it has ``obstacles = []``. Boxes
    and spheres of MoveIt's text are exact; cylinders and closed meshes become balls and capsules that contain
    them.

    Parameters
    ----------
    path : path

    Returns
    -------
    Scene

    Raises
    ------
    SceneError
        With file, table and key.

    Examples
    --------
    >>> import armangle as aa
    >>> from pathlib import Path
    >>> from tempfile import mkdtemp
    >>> file = Path(mkdtemp()) / "cell.toml"
    >>> _ = file.write_text('[[ball]]\\nname = "lamp"\\ncenter = [0.4, 0, 0.5]\\nradius = 0.1')
    >>> aa.io.load_scene(file).names
    ('lamp',)
    """
    if Path(path).suffix.lower() == ".scene":
        objects = _Moveit(_text(path, _opening.DESCRIPTION), str(path)).shapes()
        if not objects:
            raise SceneError(str(path), "objects", None, "at least one object: nothing would stand about")
        return _said_of(str(path), Scene, objects)
    table = _toml(path)
    keys = {"clearance", "soft", "ignore", "obstacles", *_KINDS}
    _refuse_other_keys(str(path), table, keys)
    shapes = [_shape(where, kind, row, Path(path).parent) for where, kind, row in _rows(path, table, _KINDS)]
    _refuse_silence(str(path), table, shapes)
    options = {key: table[key] for key in ("clearance", "soft", "ignore") if key in table}
    return _said_of(str(path), Scene, shapes, **options)


def load_body(path: PathLike) -> Body:
    """Return the collision model of a TOML file, for example from ``armangle inspect --body -o``.

    Tables ``[[ball]]`` and ``[[capsule]]`` as for `load_scene`, each with ``link``, its DH frame 0..7, and
    ``ignore``; or ``[bones]`` with ``upper_arm`` and ``forearm``, radii in m, and perhaps ``plates``, as for
    `Body.bones`.

    Parameters
    ----------
    path : path

    Returns
    -------
    Body

    Raises
    ------
    SceneError
        With file, table and key.
    """
    table = _toml(path)
    if "bones" in table:
        _refuse_other_keys(str(path), table, {"bones"})
        bones = table["bones"]
        if not isinstance(bones, dict):
            raise SceneError(str(path), "bones", bones, "a table [bones]")
        _refuse_other_keys(f"{path} [bones]", bones, {"upper_arm", "forearm", "plates"})
        _refuse_missing(f"{path} [bones]", bones, ("upper_arm", "forearm"))
        return _said_of(f"{path} [bones]", Body.bones, **bones)
    _refuse_other_keys(str(path), table, {"ignore", "ball", "capsule"})
    links: dict[int, list[Any]] = {}
    for where, kind, row in _rows(path, table, ("ball", "capsule")):
        if "link" not in row:
            wanted = "the DH frame (0..7) that carries it; a file of obstacles is read by load_scene"
            raise SceneError(where, "link", Words("missing"), wanted)
        links.setdefault(row["link"], []).append(_shape(where, kind, {k: row[k] for k in row if k != "link"}))
    return _said_of(str(path), Body, links, ignore=table.get("ignore", ()))


def body_toml(body: Body) -> str:
    """Return the text that `load_body` reads, for a collision model that is not a `Body.bones`."""
    lines = [f"# {note}" for note in body.notes]
    if body.ignore:
        lines.append(f"ignore = {json.dumps([list(pair) for pair in body.ignore])}")
    for link, shapes in body.links:
        for shape in shapes:
            lines.append("")
            if isinstance(shape, Ball):
                lines += ["[[ball]]", f"center = {list(shape.center)!r}", f"radius = {shape.radius!r}"]
            elif isinstance(shape, Capsule):
                lines += ["[[capsule]]", f"begin = {list(shape.begin)!r}", f"end = {list(shape.end)!r}"]
                lines += [f"radius = {shape.radius!r}"]
            lines.append(f"link = {link}")
            if shape.name is not None:
                lines.append(f"name = {json.dumps(shape.name)}")
    return "\n".join(lines).lstrip() + "\n"


def _text(path: PathLike, most: int) -> str:
    """Return the text of a file; raise if it cannot be read or is larger than `most` bytes."""

    def fail(why: str) -> NoReturn:
        """Raise the error of a file that cannot be read."""
        raise SceneError("file", "path", str(path), f"a text file that can be read ({why})")

    return _opening.text_of(path, most, fail)


def _toml(path: PathLike) -> dict[str, Any]:
    """Return the tables of a TOML file."""
    try:
        return _opening.parse_toml(_text(path, _opening.TABLES))
    except SceneError:
        raise
    except ValueError as error:
        raise SceneError("file", "path", str(path), f"TOML ({error})") from None


def _refuse_other_keys(where: str, table: dict[str, Any], known: set[str]) -> None:
    """Raise if a table has a key that is not in `known`."""
    for key in table:
        if key not in known:
            raise SceneError(where, "key", key, f"one of {', '.join(sorted(known))}")


def _refuse_silence(where: str, table: dict[str, Any], shapes: list[Shape]) -> None:
    """Raise if a file has no obstacles and does not say `obstacles = []`."""
    if "obstacles" in table and (table["obstacles"] != [] or shapes):
        raise SceneError(where, "obstacles", table["obstacles"], "[], and no table of a shape beside it")
    if not shapes and "obstacles" not in table:
        tables = ", ".join(f"[[{kind}]]" for kind in _KINDS)
        raise SceneError(
            where, "obstacles", Words("missing"), f"a table {tables}, or obstacles = [] where there are none"
        )


def _refuse_missing(where: str, table: dict[str, Any], keys: tuple[str, ...]) -> None:
    """Raise a `SceneError` if a table lacks one of the keys."""
    for key in keys:
        if key not in table:
            raise SceneError(where, key, Words("missing"), f"keys {', '.join(keys)}")


def _rows(path: PathLike, table: dict[str, Any], kinds: Any) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield the tables [[kind]] of a file, each with its name for messages."""
    for kind in kinds:
        rows = table.get(kind, [])
        if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
            raise SceneError(str(path), kind, rows, f"tables [[{kind}]]")
        for at, row in enumerate(rows):
            yield f"{path} [[{kind}]] {at}", kind, row


def _shape(where: str, kind: str, row: dict[str, Any], folder: Path | None = None) -> Shape:
    """Return the shape of one table [[kind]]; file names in it are relative to `folder`."""
    make, wanted, more = _KINDS[kind]
    _refuse_other_keys(where, row, {*wanted, *more})
    _refuse_missing(where, row, wanted)
    values = dict(row)
    if "file" in row:
        if not isinstance(row["file"], str):
            raise SceneError(where, "file", row["file"], "the name of a file")
        values["path"] = (folder or Path()) / values.pop("file")
    if kind == "hull" and ("file" in row) == ("points" in row):
        raise SceneError(where, "points", row.get("points"), "either points or a file of them")
    try:
        if kind == "hull" and "file" in row:
            values["points"] = load_cloud(values.pop("path"), 0.0).points
        if kind == "box":
            values["pose"] = pose(values.pop("position"), rpy=values.pop("rpy", [0.0, 0.0, 0.0]))
    except SceneError as error:
        raise _moved(where, error) from None
    except ArmangleError as error:
        given, why = [row.get("position"), row.get("rpy")], f"a place (m) and angles (rad): {error}"
        raise SceneError(where, "position, rpy", given, why) from None
    shape: Shape = _said_of(where, make, **values)
    return shape


def _said_of(where: str, make: Callable[..., _Made], *given: Any, **named: Any) -> _Made:
    """Return make(*given, **named); a SceneError is raised again with its place in the file."""
    try:
        return make(*given, **named)
    except SceneError as error:
        raise _moved(where, error) from None


def _moved(where: str, error: SceneError) -> SceneError:
    """Return the error with its place in the file in front."""
    wanted = str(error).rpartition(", wanted ")[2]
    return SceneError(f"{where}: {error.shape}", error.name, error.value, wanted)


class _Moveit:
    """Reads MoveIt's text of a planning scene: a name, then an object after each ``*``, then ``.``.

    An object: its name; in the newer format its pose (three numbers, four numbers); the number of shapes;
    each with its pose and colour; in the newer format its subframes.
    """

    def __init__(self, text: str, source: str) -> None:
        """Split the text into lines that are not empty; `source` names it in errors."""
        self.lines = [line.strip() for line in text.splitlines() if line.strip()]
        self.source = source
        self.at = 1

    def fail(self, wanted: str) -> NoReturn:
        """Raise at the present line; `wanted` says what should be there."""
        line = self.lines[self.at] if self.at < len(self.lines) else "the end of the file"
        raise SceneError(self.source, f"line {self.at + 1} (of those with text)", line, wanted)

    def line(self) -> str:
        """Return the present line and go to the next."""
        if self.at >= len(self.lines):
            self.fail("more lines")
        self.at += 1
        return self.lines[self.at - 1]

    def numbers(self, count: int) -> Floats:
        """Return the numbers of the present line, exactly `count` and finite, or raise; go to the next."""
        words = self.lines[self.at].split() if self.at < len(self.lines) else []
        try:
            values = np.array([number_in(word) for word in words])
        except ValueError:
            self.fail(f"{count} numbers")
        if len(values) != count or not np.isfinite(values).all():
            self.fail(f"{count} finite numbers")
        self.at += 1
        return values

    def pose(self) -> Floats:
        """Return the pose (4, 4) of a line x y z (m) and a line of a quaternion x y z w."""
        position, turn = self.numbers(3), self.numbers(4)
        try:
            return np.asarray(pose(position, xyzw=turn))
        except ArmangleError:
            self.at -= 1
            self.fail("a quaternion x y z w of length 1")

    def count(self) -> int:
        """Return the whole number, not negative, of the present line, or raise; go to the next."""
        value = float(self.numbers(1)[0])
        if value < 0 or value != int(value):
            self.at -= 1
            self.fail("how many")
        return int(value)

    def shapes(self) -> list[Shape]:
        """Return the shapes of all objects of the file."""
        out: list[Shape] = []
        while self.at < len(self.lines) and self.lines[self.at] != ".":
            if not self.line().startswith("*"):
                self.at -= 1
                self.fail("an object, '* NAME', or '.' after the last")
            name = self.lines[self.at - 1][1:].strip() or f"object_{len(out)}"
            out += self.object(name)
        return out

    def object(self, name: str) -> list[Shape]:
        """Return the shapes of one object; its pose is there in newer files alone."""
        newer = self.at < len(self.lines) and len(self.lines[self.at].split()) > 1
        frame = self.pose() if newer else np.eye(4)
        rows = [self.shape(frame) for _ in range(self.count())]
        if newer and self.at < len(self.lines) and self.lines[self.at].isdigit():
            for _ in range(self.count()):
                self.line()
                self.pose()
        made = [make for row in rows for make in row]
        return [make(name if len(made) == 1 else f"{name}_{k}") for k, make in enumerate(made)]

    def shape(self, frame: Floats) -> list[Callable[[str], Shape]]:
        """Return functions from a name to a shape: to a box itself, or to each cover of another shape."""
        kind = self.line()
        rods: list[Rod] = []
        size = np.zeros(3)
        match kind:
            case "box":
                size = self.numbers(3)
            case "sphere":
                rods = [Rod(np.zeros(3), np.zeros(3), float(self.numbers(1)[0]))]
            case "cylinder":
                radius, length = self.numbers(2)
                rods = cover_cylinder(float(radius), float(length), _ROUND)
            case "mesh":
                rods = self.mesh()
            case _:
                self.at -= 1
                self.fail("box, sphere, cylinder or mesh")
        place = frame @ self.pose()
        self.numbers(4)  # its colour
        if kind == "box":
            return [lambda name: Box(place, size, name=name)]
        return [partial(_as_shape, rod, place) for rod in rods]

    def mesh(self) -> list[Rod]:
        """Return capsules that cover a mesh of triangles."""
        corners, triangles = (int(n) for n in self.numbers(2))
        vertices = np.array([self.numbers(3) for _ in range(corners)]).reshape(-1, 3)
        faces = np.array([self.numbers(3) for _ in range(triangles)], dtype=np.int64).reshape(-1, 3)
        if not triangles or faces.min() < 0 or faces.max() >= corners:
            self.fail("triangles of the mesh's own corners")
        vertices, faces = merged(vertices, faces)
        if open_edges(faces):
            self.fail("a closed mesh before it")
        return cover_mesh(vertices, faces, 2 * _ROUND)


def _as_shape(rod: Rod, place: Floats, name: str) -> Shape:
    """Return a rod as a ball or a capsule at a pose `place` (4, 4)."""
    begin, end = (place[:3, :3] @ p + place[:3, 3] for p in (rod.begin, rod.end))
    return as_shape(name, Rod(begin, end, rod.radius))
