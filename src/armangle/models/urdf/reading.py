"""Kinematic chains from URDF and back: seven rotating joints on the path from base to tip.

This file reads the numbers of a URDF: axes, limits, velocities, and with `origin.py` its origins (`tags.py`
has its elements, as text). Revolute, continuous and fixed joints count; joints off the path (a gripper, a
second arm) are ignored. :mod:`armangle.models.detect` interprets the axes.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import NoReturn

import numpy as np

from ... import _opening
from ..._arrays import JOINTS, check_source, chosen, number_in
from ...errors import ModelError
from ..axes import exceeds
from ..candidates import Candidate, RigidBody, Tree, TreeJoint, find_candidates, guess, moved_base, unknown
from ..chain import Chain, FloatArray, Joint, rigid_inverse
from ..report import CONTINUOUS, NOT_USED
from .encoding import decoded
from .origin import origin
from .tags import JointElement, RobotElement, parse_robot

Source = str | bytes | os.PathLike[str]
Step = tuple[JointElement, bool]

MAX_BYTES = _opening.DESCRIPTION
MAX_LENGTH = 100.0
HUGE_LIMIT = 1e6  # rad: above the largest angle that the core accepts
_MOVING = ("revolute", "continuous")
_REFUSED = ("prismatic", "floating", "planar")
_CONTINUOUS_LIMITS = ("ignore", "use")
_UTF8_MARK, _BLANK = b"\xef\xbb\xbf", "\ufeff \t\r\n"


def chain_along(
    robot: RobotElement, base: str, tip: str, steps: Sequence[Step], continuous_limits: str = "ignore"
) -> Chain:
    """Return the chain between two links of a file; fixed joints are merged into the next frame.

    `steps` are the joints from base to tip, each with True if it is followed from parent to child.
    `continuous_limits` "ignore" or "use": treatment of limits of a continuous joint. Raises `ModelError` for
    a zero axis, missing or reversed limits, an invalid or absurd number.
    """
    joints: list[Joint] = []
    notes: list[str] = []
    frame = np.eye(4)
    for element, downward in steps:
        robot.refuse_xacro(element)
        placed = _checked_origin(robot, element)
        frame = frame @ placed if downward else frame
        if element.kind != "fixed":
            axis = _axis(robot, element) * (1.0 if downward else -1.0)
            lower, upper = _limits(robot, element, continuous_limits, notes)
            velocity = _velocity(robot, element, notes)
            joints.append(Joint(element.name, frame, axis, lower, upper, velocity))
            frame = np.eye(4)
        frame = frame if downward else frame @ rigid_inverse(placed)
    notes += _closer(robot, [element for element, _ in steps if element.kind != "fixed"], joints)
    name = robot.name or "arm"
    return Chain(name, base, tip, tuple(joints), frame, robot.source, (*notes, *robot.notes))


def _closer(robot: RobotElement, elements: Sequence[JointElement], joints: Sequence[Joint]) -> list[str]:
    """Return notes on unused numbers of the file: narrower limits in other parts, accelerations and jerks."""
    soft, commands, more = [], [], []
    for element, joint in zip(elements, joints, strict=True):
        safety = element.parts.get("safety_controller")
        limits = safety.attributes if safety else {}
        soft += _narrower(joint, limits.get("soft_lower_limit", ""), limits.get("soft_upper_limit", ""))
        ends = robot.commands.get(joint.name, {})
        commands += _narrower(joint, ends.get("min", ""), ends.get("max", ""))
        stated = element.parts["limit"].attributes if "limit" in element.parts else {}
        more += [key for key in ("acceleration", "deceleration", "jerk") if key in stated and key not in more]
    notes = [f"soft limits (safety_controller) are {NOT_USED}: joint {', '.join(soft)}"] if soft else []
    notes += (
        [f"limits of commands (ros2_control) are {NOT_USED}: joint {', '.join(commands)}"] if commands else []
    )
    return notes + ([f"<limit {'= '.join(more)}=> is {NOT_USED}"] if more else [])


def _narrower(joint: Joint, lower: str, upper: str) -> list[str]:
    """Return [text] of a joint's limits in another part of the file if they are narrower or no numbers,
    else [].
    """
    try:
        low, high = number_in(lower or "-inf"), number_in(upper or "inf")
    except ValueError:
        low, high = math.inf, -math.inf
    closer = exceeds(low, joint.lower) or exceeds(joint.upper, high)
    return [f"{joint.name!r} {lower.strip() or '-inf':.20} to {upper.strip() or 'inf':.20}"] if closer else []


def _checked_origin(robot: RobotElement, joint: JointElement) -> FloatArray:
    """Return the frame (4, 4) of a joint in its parent link; the identity by default."""
    try:
        frame = origin(lambda key, count: robot.numbers(joint, "origin", key, count))
    except ModelError:
        raise
    except ValueError as error:
        robot.fail(f"joint {joint.name!r}: <origin> {error}", joint.parts["origin"])
    farthest = np.abs(frame[:3, 3]).max()
    if farthest > MAX_LENGTH:
        robot.fail(
            f"joint {joint.name!r} lies {farthest:g} m away, absurd for an arm "
            f"(wanted metres, at most {MAX_LENGTH:g})",
            joint.parts["origin"],
        )
    return frame


def _axis(robot: RobotElement, joint: JointElement) -> FloatArray:
    """Return the unit axis (3,) of a joint; x by default, as in URDF."""
    axis = robot.numbers(joint, "axis", "xyz", 3)
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    largest = np.abs(axis).max()
    if largest == 0.0:
        robot.fail(f"joint {joint.name!r} has a zero axis", joint.parts["axis"])
    scaled = axis / largest
    return np.asarray(scaled / np.linalg.norm(scaled), dtype=np.float64)


def _limits(
    robot: RobotElement, joint: JointElement, continuous_limits: str, notes: list[str]
) -> tuple[float, float]:
    """Return lower and upper limit, rad; infinite for a continuous joint unless `continuous_limits` is "use".

    Raises if a revolute joint has none. Notes on changed or unused limits are added to `notes`.
    """
    given = joint.parts["limit"].attributes if "limit" in joint.parts else {}
    continuous = joint.kind == "continuous"
    if "lower" not in given and "upper" not in given:
        if not continuous:
            robot.fail(f"revolute joint {joint.name!r} has no limits (lower, upper)", joint)
        return -math.inf, math.inf
    lower, upper = (_number(robot, joint, key) or 0.0 for key in ("lower", "upper"))
    if not continuous and len(given.keys() & {"lower", "upper"}) == 1:
        missing = "upper" if "lower" in given else "lower"
        notes.append(f"joint {joint.name!r} states no {missing} limit, which is 0 in a URDF")
    if lower > upper:
        robot.fail(
            f"joint {joint.name!r}: lower limit {lower:g} is above upper limit {upper:g}",
            joint.parts["limit"],
        )
    if continuous and lower < upper:
        used = continuous_limits == "use"
        what = "used all the same" if used else f"{NOT_USED} (continuous_limits='use')"
        notes.append(
            f"joint {joint.name!r} {CONTINUOUS}, but states {lower:g} to {upper:g} rad: they are {what}"
        )
    if continuous and not (lower < upper and continuous_limits == "use"):
        return -math.inf, math.inf
    return _unless_huge(joint, "lower", lower, notes), _unless_huge(joint, "upper", upper, notes)


def _unless_huge(joint: JointElement, key: str, limit: float, notes: list[str]) -> float:
    """Return a limit (rad); if it is so large that none is meant, an infinite one and add a note."""
    if abs(limit) < HUGE_LIMIT:
        return limit
    notes.append(f"{key} limit of joint {joint.name!r} is {limit:g} rad: taken as none")
    return -math.inf if key == "lower" else math.inf


def _velocity(robot: RobotElement, joint: JointElement, notes: list[str]) -> float:
    """Return the largest velocity, rad/s; infinite if it is missing, zero, negative or infinite."""
    velocity = _number(robot, joint, "velocity")
    if velocity is None:
        return math.inf
    if not 0.0 < velocity < math.inf:
        notes.append(f"velocity of joint {joint.name!r} is {velocity:g}: taken as not given")
        return math.inf
    return velocity


def _number(robot: RobotElement, joint: JointElement, key: str) -> float | None:
    """Return one number of the joint's limit, None if it is missing."""
    values = robot.numbers(joint, "limit", key, 1, infinite=True)
    return None if values is None else float(values[0])


class UrdfModel:
    """The links and joints of a URDF, parsed once.

    `source` is a file, or the XML text itself (bytes, or a str that begins with ``<``). `folder` is that of
    the file, which names of meshes are relative to. Raises `ModelError` with file, line and column, and the
    name of the link or joint.
    """

    def __init__(self, source: Source) -> None:
        """Parse the text; blank lines before it are permitted."""
        check_source(source, bytes)
        name, self.folder = "XML text", Path()
        if isinstance(source, os.PathLike) or not (isinstance(source, bytes) or _begins(source)):
            name, self.folder = str(Path(source)), Path(source).parent
            source = _opening.bytes_of(source, MAX_BYTES, partial(_refuse, name))
        if len(source) > MAX_BYTES:
            _refuse(name, _opening.too_long(len(source), MAX_BYTES))
        if isinstance(source, str):
            self._document: str | bytes = source.lstrip(_BLANK)
            skipped = source[: len(source) - len(self._document)].count("\n")
        else:
            self._document = source.removeprefix(_UTF8_MARK).lstrip(b" \t\r\n")
            skipped = source[: len(source) - len(self._document)].count(b"\n")
        self.robot = parse_robot(self._document, name, skipped)
        self.above = self._parents()

    @property
    def text(self) -> str | bytes:
        """The text from its first tag on, in an encoding that XML parsers read."""
        return self._document if isinstance(self._document, str) else decoded(self._document)[0]

    def chain(
        self,
        base: str | None = None,
        tip: str | None = None,
        *,
        continuous_limits: str = "ignore",
        offset: bool = False,
    ) -> Chain:
        """Return the chain of seven joints from base link to tip link, in the file's own frames and joint
        coordinates.

        Missing names are guessed: for a tip the seven rotating joints above it, else the only chain of seven,
        or the only S-R-S one of several, as `candidates` lists them; with `offset` the only one with an
        offset wrist or shoulder. A continuous joint has no limits according to URDF, but some files have
        them: `continuous_limits` is "ignore" or "use". Notes list changed values. Raises `ModelError`.
        """
        chosen("continuous_limits", continuous_limits, _CONTINUOUS_LIMITS)
        robot, guessed = self.robot, tuple[str, ...]()
        for role, link in (("base", base), ("tip", tip)):
            if link is not None and link not in robot.links:
                robot.fail(unknown("link", link, role, list(robot.links)))
        if base is None or tip is None:
            base, tip, guessed = guess(self.tree, self.between, base, tip, self.fail, offset=offset)
        steps = self.path(base, tip)
        moving = [joint for joint, _ in steps if joint.kind != "fixed"]
        for joint in moving:
            if joint.kind in _REFUSED:
                instead = self.tree.instead_of(base, tip)
                what = f"joint {joint.name!r} on the path is {joint.kind}, wanted revolute{instead}"
                robot.fail(what, joint)
            _refuse_unless_rotating(robot, joint)
        if len(moving) != JOINTS:
            names = ", ".join(joint.name for joint in moving) or "none"
            counted = f"{len(moving)} moving joints from {base!r} to {tip!r}, wanted {JOINTS}: {names}"
            robot.fail(f"{counted}{self.tree.instead_of(base, tip)}")
        chain = chain_along(robot, base, tip, steps, continuous_limits)
        lift = self._lift(base)
        moved = () if lift is None or lift in moving else (moved_base(lift.name, base),)
        return replace(chain, notes=(*guessed, *chain.notes, *moved))

    def candidates(self, base: str | None = None) -> list[Candidate]:
        """Return every chain of seven rotating joints, S-R-S first; with ``base`` only those from there."""
        if base is not None and base not in self.robot.links:
            self.robot.fail(unknown("link", base, "base", list(self.robot.links)))
        return find_candidates(self.tree, self.between, base)

    def between(self, base: str, tip: str) -> Chain:
        """Return the chain of any joints between two links."""
        return chain_along(self.robot, base, tip, self.path(base, tip))

    def fail(self, message: str) -> NoReturn:
        """Raise the file's error, with a list of joints that were left out."""
        lost = "".join(f"; {note}" for note in self.robot.notes if "that is not there" in note)
        self.robot.fail(message + lost)

    def path(self, base: str, tip: str) -> list[Step]:
        """Return the joints from base to tip, each with True if it is followed from parent to child."""
        up, down = self._way_up(base), self._way_up(tip)
        if up[-1] != down[-1]:
            self.fail(f"no path from {base!r} to {tip!r}: their roots are {up[-1]!r} and {down[-1]!r}")
        while up and down and up[-1] == down[-1]:
            up.pop()
            down.pop()
        return [(self.above[link], False) for link in up] + [(self.above[link], True) for link in down[::-1]]

    @cached_property
    def tree(self) -> Tree:
        """The rigid bodies of the file and the joints between them."""
        robot, above = self.robot, self.above
        below: dict[str, list[str]] = {link: [] for link in robot.links}
        for child, joint in above.items():
            below[_ends(robot, joint)[0]].append(child)
        tree, body_of = Tree(), dict[str, int]()
        pending = [link for link in robot.links if link not in above][::-1]
        while pending:
            link = pending.pop()
            if link not in above or above[link].kind != "fixed":
                body_of[link] = len(tree.bodies)
                tree.bodies.append(RigidBody())
            else:
                body_of[link] = body_of[_ends(robot, above[link])[0]]
            fixed = [child for child in below[link] if above[child].kind == "fixed"]
            tree.bodies[body_of[link]].add(link, len(fixed))
            pending += below[link][::-1]
        for link in robot.links:
            if link not in body_of:
                self._way_up(link)  # reports the loop to which it belongs
        for child, joint in above.items():
            robot.refuse_expression(joint)
            if joint.kind != "fixed":
                ends = (body_of[_ends(robot, joint)[0]], body_of[child])
                bound = _bound(joint)
                tree.joints.append(TreeJoint(joint.name, joint.kind in _MOVING and not bound, *ends, bound))
        return tree

    def _parents(self) -> dict[str, JointElement]:
        """Return by link name the joint that carries it; raise for two. Joints at missing links are noted."""
        above: dict[str, JointElement] = {}
        for joint in self.robot.joints.values():
            parent, child = _ends(self.robot, joint)
            lost = [link for link in (parent, child) if link not in self.robot.links]
            if lost:
                what = f"joint {joint.name!r} names a link {lost[0]!r} that is not there: left out"
                self.robot.notes.append(what)
            elif child in above:
                others = f"{above[child].name!r} and {joint.name!r}"
                self.robot.fail(f"link {child!r} hangs on two joints, {others}", joint)
            else:
                above[child] = joint
        return above

    def _way_up(self, link: str) -> list[str]:
        """Return the links from ``link`` to its root, both included."""
        way = {link: None}
        while link in self.above:
            joint = self.above[link]
            link, _ = _ends(self.robot, joint)
            if link in way:
                self.robot.fail(f"joint {joint.name!r} closes a loop at link {link!r}", joint)
            way[link] = None
        return list(way)

    def _lift(self, link: str) -> JointElement | None:
        """Return the nearest joint above a link that moves it, None if the link is fixed."""
        while link in self.above and self.above[link].kind == "fixed":
            link, _ = _ends(self.robot, self.above[link])
        return self.above.get(link)


def _begins(text: str) -> bool:
    """Return whether a str is XML text, not the name of a file."""
    return text.lstrip(_BLANK).startswith("<")


def _refuse(source: str, why: str) -> NoReturn:
    """Raise the error of a source."""
    raise ModelError(why, source=source)


def _ends(robot: RobotElement, joint: JointElement) -> tuple[str, str]:
    """Return the names of the parent and the child link."""
    names = []
    for part in ("parent", "child"):
        element = joint.parts.get(part)
        if element is None or "link" not in element.attributes:
            robot.fail(f"joint {joint.name!r} has no <{part} link=...>", joint)
        names.append(element.attributes["link"])
    return names[0], names[1]


def _bound(joint: JointElement) -> str:
    """Return why a rotating joint cannot move on its own (it mimics another, or is of unknown type); "" if it
    can.
    """
    if joint.kind not in (*_MOVING, *_REFUSED, "fixed"):
        return f"has unknown type {joint.kind!r}"
    if joint.kind in _MOVING and "mimic" in joint.parts:
        return f"mimics joint {joint.parts['mimic'].attributes.get('joint', '')!r}"
    return ""


def _refuse_unless_rotating(robot: RobotElement, joint: JointElement) -> None:
    """Raise for a joint on the path that mimics another, is of unknown type, or is an expression of xacro."""
    robot.refuse_expression(joint)
    bound = _bound(joint)
    if bound:
        robot.fail(f"joint {joint.name!r} on the path {bound}", joint)
