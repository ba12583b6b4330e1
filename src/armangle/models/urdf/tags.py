"""Links and joints of a URDF text, unparsed: `urdf` reads a joint's numbers when it needs them."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from ..._arrays import number_in
from ...errors import ModelError
from ..report import NOT_USED
from .encoding import decoded

_JOINT_PARTS = ("parent", "child", "origin", "axis", "limit", "mimic", "safety_controller")
_COMMAND = ["robot", "ros2_control", "joint", "command_interface", "param"]
_ROBOT_DEPTH, _PART_DEPTH, _DETAIL_DEPTH = 1, 2, 3
_XACRO = "xacro:"
_SPACE = re.compile("[ \t\r\n]+")
_DEFINITIONS = ("xacro:property", "xacro:arg", "xacro:macro")
_CONDITIONS = ("xacro:if", "xacro:unless")


@dataclass
class Element:
    """One XML element: its attributes and its position."""

    attributes: dict[str, str]
    line: int
    column: int


@dataclass
class JointElement(Element):
    """One ``<joint>`` of the robot, with its inner elements by name."""

    name: str = ""
    kind: str = ""
    parts: dict[str, Element] = field(default_factory=dict)
    xacro: tuple[str, Element] | None = None


@dataclass
class RobotElement:
    """The ``<robot>``: its name, its links, its joints in file order, and what was left out.

    `commands` has the text of "min" and "max" of ros2_control's position commands for a joint.
    """

    source: str
    name: str = ""
    links: dict[str, Element] = field(default_factory=dict)
    joints: dict[str, JointElement] = field(default_factory=dict)
    commands: dict[str, dict[str, str]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)

    def fail(self, message: str, at: Element | None = None) -> NoReturn:
        """Raise :class:`ModelError` with this file and the place of an element."""
        line, column = (at.line, at.column) if at else (None, None)
        raise ModelError(message, source=self.source, line=line, column=column)

    def refuse_xacro(self, joint: JointElement) -> None:
        """Raise :class:`ModelError` if a joint contains a tag of xacro."""
        if joint.xacro is not None:
            tag, at = joint.xacro
            self.fail(f"joint {joint.name!r} holds <{tag}>: {_NOT_URDF}", at)

    def refuse_expression(self, joint: JointElement) -> None:
        """Raise :class:`ModelError` if the type of a joint is an expression of xacro."""
        if is_expression(joint.kind):
            what = f"joint {joint.name!r}: <joint type={joint.kind!r}>"
            self.fail(f"{what} is an expression of xacro; {XACRO_ADVICE}", joint)

    def numbers(
        self, joint: JointElement, part: str, key: str, count: int, *, infinite: bool = False
    ) -> NDArray[np.float64] | None:
        """Return the `count` numbers of an attribute inside a joint; None if missing.

        NaN raises, and unless `infinite` also an infinite number.
        """
        element = joint.parts.get(part)
        text = element.attributes.get(key) if element else None
        if text is None:
            return None
        what = f"joint {joint.name!r}: <{part} {key}={text!r}>"
        if is_expression(text):
            self.fail(f"{what} is an expression of xacro; {XACRO_ADVICE}", element)
        try:
            return numbers_in(text, count, infinite=infinite)
        except ValueError as error:
            self.fail(f"{what} {error}", element)


def is_expression(text: str) -> bool:
    """Return whether an attribute's text is an expression of xacro."""
    return "${" in text or "$(" in text


def numbers_in(text: str, count: int, *, infinite: bool = False) -> NDArray[np.float64]:
    """Return the `count` numbers of an attribute's text; raise for NaN and, unless `infinite`, infinities.

    The `ValueError` for no numbers, or another count, quotes the text or the count.
    """
    try:
        values = np.array([number_in(word) for word in _SPACE.split(text.strip(" \t\r\n"))])
    except ValueError:
        raise ValueError(f"is not {count} number{'s' * (count > 1)}") from None
    if values.size != count:
        raise ValueError(f"has {values.size} numbers, wanted {count}")
    if np.isnan(values).any() or not (infinite or np.isfinite(values).all()):
        raise ValueError("is not finite")
    return values


class _Reader:
    """Builds a :class:`RobotElement` from the events of one expat parser."""

    def __init__(self, source: str, skipped: int) -> None:
        """Begin to read; `skipped` is the number of lines before the text."""
        self.robot = RobotElement(source)
        self.skipped = skipped
        self.open: list[str] = []  # the present tag and those around it; where each begins
        self.began: list[Element] = []
        self.joint: JointElement | None = None
        self.left_out: dict[str, list[int]] = {}
        self.macros: set[str] = set()
        self.includes = False
        self.calls: list[tuple[str, Element]] = []
        self.parser = expat.ParserCreate()
        self.parser.StartDoctypeDeclHandler = self._refuse_doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._text

    def _here(self) -> Element:
        """Return the present place in the file, as an element without attributes."""
        parser = self.parser
        return Element({}, parser.CurrentLineNumber + self.skipped, parser.CurrentColumnNumber + 1)

    def _refuse_doctype(self, *_: object) -> None:
        """Raise for a DOCTYPE, whose entities could expand without bound."""
        message = "a DOCTYPE is refused: a robot needs none, and entities can expand without bound"
        self.robot.fail(message, self._here())

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        """Handle an opening tag: of the robot, a link, a joint, or a part of a joint."""
        self.open.append(tag)
        element = self._here()
        element.attributes = attributes
        self.began.append(element)
        depth = len(self.open)
        if tag.startswith(_XACRO):
            self._start_xacro(tag, element)
        elif depth == _ROBOT_DEPTH:
            self._start_robot(tag, element)
        elif depth > _PART_DEPTH and tag in ("link", "joint") and self._in_xacro():
            does = "decides on" if self.open[-2] in _CONDITIONS else "holds"
            self.robot.fail(f"<{self.open[-2]}> {does} a {tag}: {_NOT_URDF}", self.began[-2])
        elif depth == _PART_DEPTH and tag in ("link", "joint"):
            self._start_part(tag, element)
        elif depth == _DETAIL_DEPTH and self.joint and tag in _JOINT_PARTS:
            if tag in self.joint.parts:
                what = f"joint {self.joint.name!r} has more than one <{tag}>: the first one is taken"
                self.robot.notes += [] if what in self.robot.notes else [what]
            self.joint.parts.setdefault(tag, element)
        elif depth == _PART_DEPTH and "joint" in tag.lower():
            self.robot.notes.append(f"<{tag}> in line {element.line} is no joint of a URDF: {NOT_USED}")

    def _text(self, text: str) -> None:
        """Store ros2_control's position commands of a joint."""
        if self.open != _COMMAND or self.began[3].attributes.get("name") != "position":
            return
        joint, end = self.began[2].attributes.get("name", ""), self.began[4].attributes.get("name", "")
        if end in ("min", "max"):
            ends = self.robot.commands.setdefault(joint, {})
            ends[end] = ends.get(end, "") + text

    def _in_xacro(self) -> bool:
        """Return whether the present tag is in tags of xacro alone, outside a macro's definition."""
        around = self.open[1:-1]
        return "xacro:macro" not in around and all(other.startswith(_XACRO) for other in around)

    def _start_xacro(self, tag: str, element: Element) -> None:
        """Note a tag of xacro; reject one that could create links or joints, here or at the end."""
        if "xacro:macro" in self.open[:-1]:
            return  # part of a definition: no effect by itself
        self.left_out.setdefault(tag, []).append(element.line)
        if self.joint is not None:
            self.joint.xacro = tag, element
        elif tag == "xacro:include":
            self.includes = True
        elif tag == "xacro:macro":
            self.macros.add(element.attributes.get("name", ""))
        elif self._in_xacro() and tag not in (*_DEFINITIONS, *_CONDITIONS):
            self.calls.append((tag, element))

    def finish(self) -> RobotElement:
        """Return the robot; reject calls of macros that may be defined, and xacro without a link outside."""
        for tag, element in self.calls:
            if self.includes or tag.removeprefix(_XACRO) in self.macros:
                self.robot.fail(f"<{tag}> calls a macro: {_NOT_URDF}", element)
        for tag, lines in self.left_out.items():
            if not self.robot.links:
                self.robot.fail(f"no link outside <{tag}>: {_NOT_URDF}", Element({}, lines[0], 1))
            more = f" and {len(lines) - 1} more" if len(lines) > 1 else ""
            self.robot.notes.append(f"<{tag}> in line {lines[0]}{more} is left over from xacro: left out")
        return self.robot

    def _start_robot(self, tag: str, element: Element) -> None:
        """Handle the outer tag; raise unless it is <robot>."""
        if tag != "robot":
            self.robot.fail(f"not a robot: the outer element is <{tag}>, wanted <robot>", element)
        self.robot.name = element.attributes.get("name", "")

    def _start_part(self, tag: str, element: Element) -> None:
        """Handle the tag of a link or joint; raise if its name is missing or used twice."""
        name = element.attributes.get("name", "")
        if not name:
            self.robot.fail(f"a <{tag}> has no name", element)
        if name in (self.robot.links if tag == "link" else self.robot.joints):
            self.robot.fail(f"{tag} {name!r} is there twice", element)
        if tag == "link":
            self.robot.links[name] = element
            return
        kind = element.attributes.get("type", "")
        self.joint = JointElement(element.attributes, element.line, element.column, name, kind)
        self.robot.joints[name] = self.joint

    def _end(self, _tag: str) -> None:
        """Handle a closing tag."""
        if len(self.open) == _PART_DEPTH:
            self.joint = None
        self.open.pop()
        self.began.pop()


XACRO_ADVICE = "run xacro first: xacro FILE.urdf.xacro > FILE.urdf"
_NOT_URDF = f"this is xacro, not URDF; {XACRO_ADVICE}"


def parse_robot(text: str | bytes, source: str, skipped: int = 0) -> RobotElement:
    """Return the links and joints of a URDF text, the whole document.

    `source` is its name in messages, `skipped` the number of lines of the file before it. Raises `ModelError`
    for text that is not XML, a DOCTYPE, xacro that creates links or joints, no robot, a missing or duplicate
    name.
    """
    reader = _Reader(source, skipped)
    if isinstance(text, bytes):
        text, note = decoded(text)
        reader.robot.notes += [note] if note else []
    parse: Callable[[str | bytes, bool], int] = reader.parser.Parse
    try:
        parse(text, True)
    except expat.ExpatError as error:
        message = f"not XML: {expat.ErrorString(error.code)}"
        raise ModelError(
            message, source=source, line=error.lineno + skipped, column=error.offset + 1
        ) from None
    except ModelError:
        raise
    except (LookupError, ValueError) as error:  # an unknown encoding, or a text that violates it
        raise ModelError(f"not XML: {error}", source=source) from None
    return reader.finish()
