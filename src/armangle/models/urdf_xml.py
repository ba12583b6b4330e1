"""Links and joints of a URDF text, as written: no number is read before its joint is needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NoReturn
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from ..errors import UrdfError

_JOINT_PARTS = ("parent", "child", "origin", "axis", "limit", "mimic")
_ROBOT_DEPTH, _PART_DEPTH, _DETAIL_DEPTH = 1, 2, 3


@dataclass
class Element:
    """One XML element: its attributes and where it begins."""

    attributes: dict[str, str]
    line: int
    column: int


@dataclass
class JointElement(Element):
    """One ``<joint>`` of the robot, with the elements inside it by name."""

    name: str = ""
    kind: str = ""
    parts: dict[str, Element] = field(default_factory=dict)


@dataclass
class RobotElement:
    """The ``<robot>``: its name, its links, its joints in file order."""

    source: str
    name: str = ""
    links: dict[str, Element] = field(default_factory=dict)
    joints: dict[str, JointElement] = field(default_factory=dict)

    def fail(self, message: str, at: Element | None = None) -> NoReturn:
        """Raise :class:`UrdfError` at an element of this file."""
        line, column = (at.line, at.column) if at else (None, None)
        raise UrdfError(message, source=self.source, line=line, column=column)

    def numbers(self, joint: JointElement, part: str, key: str, count: int) -> NDArray[np.float64] | None:
        """Return ``count`` finite numbers of an attribute inside a joint, None where absent."""
        element = joint.parts.get(part)
        text = element.attributes.get(key) if element else None
        if text is None:
            return None
        what = f"joint {joint.name!r}: <{part} {key}={text!r}>"
        try:
            values = np.array([float(word) for word in text.split()])
        except ValueError:
            self.fail(f"{what} is not {count} number{'s' * (count > 1)}", element)
        if values.size != count:
            self.fail(f"{what} has {values.size} numbers, wanted {count}", element)
        if not np.isfinite(values).all():
            self.fail(f"{what} is not finite", element)
        return values


class _Reader:
    """Collects a :class:`RobotElement` from the events of one expat parser."""

    def __init__(self, source: str) -> None:
        self.robot = RobotElement(source)
        self.depth = 0
        self.joint: JointElement | None = None
        self.parser = expat.ParserCreate()
        self.parser.StartDoctypeDeclHandler = self._refuse_doctype
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end

    def _here(self) -> Element:
        parser = self.parser
        return Element({}, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)

    def _refuse_doctype(self, *_: object) -> None:
        message = "a DOCTYPE is refused: a robot needs none, and entities can expand without bound"
        self.robot.fail(message, self._here())

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        self.depth += 1
        element = self._here()
        element.attributes = attributes
        if tag.startswith("xacro:"):
            self.robot.fail(f"this is xacro, not URDF (<{tag}>); {XACRO_ADVICE}", element)
        if self.depth == _ROBOT_DEPTH:
            self._start_robot(tag, element)
        elif self.depth == _PART_DEPTH and tag in ("link", "joint"):
            self._start_part(tag, element)
        elif self.depth == _DETAIL_DEPTH and self.joint and tag in _JOINT_PARTS:
            self.joint.parts[tag] = element

    def _start_robot(self, tag: str, element: Element) -> None:
        if tag != "robot":
            self.robot.fail(f"not a robot: the outer element is <{tag}>, wanted <robot>", element)
        self.robot.name = element.attributes.get("name", "")

    def _start_part(self, tag: str, element: Element) -> None:
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
        if self.depth == _PART_DEPTH:
            self.joint = None
        self.depth -= 1


XACRO_ADVICE = "run xacro first: xacro FILE.urdf.xacro > FILE.urdf"


def parse_robot(text: str | bytes, source: str) -> RobotElement:
    """Return the links and joints of a URDF text.

    Parameters
    ----------
    text : str or bytes
        The whole document.
    source : str
        What to call it in messages.

    Raises
    ------
    UrdfError
        Not XML, a DOCTYPE, xacro, not a robot, a name missing or twice.
    """
    reader = _Reader(source)
    parse: Callable[[str | bytes, bool], int] = reader.parser.Parse
    try:
        parse(text, True)
    except expat.ExpatError as error:
        message = f"not XML: {expat.ErrorString(error.code)}"
        raise UrdfError(message, source=source, line=error.lineno, column=error.offset + 1) from None
    except UrdfError:
        raise
    except (LookupError, ValueError) as error:  # an encoding that does not exist, text that has none
        raise UrdfError(f"not XML: {error}", source=source) from None
    return reader.robot
