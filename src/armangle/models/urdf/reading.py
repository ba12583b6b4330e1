"""Kinematic chains from URDF and back: seven rotating joints on the path from base to tip.

This file reads the numbers of a URDF: axes, limits, velocities, and with `origin.py` its origins (`tags.py`
has its elements, as text). Revolute, continuous and fixed joints count; joints off the path (a gripper, a
second arm) are ignored. :mod:`armangle.models.detect` interprets the axes.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NoReturn

import numpy as np

from ... import _opening
from ..._arrays import JOINTS, check_source, number_in
from ...errors import InputError, ModelError
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
_UTF8_MARK = b"\xef\xbb\xbf"


def chain_along(
    robot: RobotElement, base: str, tip: str, steps: Sequence[Step], continuous_limits: str = "ignore"
) -> Chain:
    """Return the chain of a path; fixed joints are merged into the next frame.

    Parameters
    ----------
    robot : RobotElement
        The file.
    base, tip : str
        The links at the ends of the path.
    steps : sequence of (JointElement, bool)
        Joints from base to tip, each with True if it is followed from parent to child.
    continuous_limits : {"ignore", "use"}, optional
        Treatment of limits of a continuous joint.

    Raises
    ------
    ModelError
        A zero axis, missing or reversed limits, an invalid or absurd number.
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


def read_urdf(
    source: Source,
    base: str | None = None,
    tip: str | None = None,
    *,
    continuous_limits: str = "ignore",
    offset: bool = False,
) -> Chain:
    """Return the chain of seven joints from base link to tip link.

    Parameters
    ----------
    source : str, bytes or path
        A file, or the XML text itself (bytes, or a str that begins with ``<``).
    base, tip : str, optional
        Link names. Missing ones are guessed: the only chain of seven rotating joints, or the only S-R-S one
        of several. :func:`urdf_candidates` lists the choices.
    continuous_limits : {"ignore", "use"}, optional
        A continuous joint has no limits according to URDF, but some files have them.
    offset : bool, optional
        Guess an arm with an offset wrist or shoulder instead of an S-R-S one.

    Returns
    -------
    Chain
        In the file's own frames and joint coordinates. Its notes list changed values.

    Raises
    ------
    ModelError
        With file, line and column, and the name of the link or joint.
    """
    if continuous_limits not in _CONTINUOUS_LIMITS:
        raise InputError(f"continuous_limits is {continuous_limits!r}, wanted one of {_CONTINUOUS_LIMITS}")
    robot = _load(source)
    above = _parents(robot)
    guessed: tuple[str, ...] = ()
    for role, link in (("base", base), ("tip", tip)):
        if link is not None and link not in robot.links:
            robot.fail(unknown("link", link, role, list(robot.links)))
    if base is None or tip is None:
        tree, reader = _tree(robot, above), _Reader(robot, above)
        base, tip, guessed = guess(tree, reader, base, tip, _failing(robot), offset=offset)
    steps = _path(robot, above, base, tip)
    moving = [joint for joint, _ in steps if joint.kind != "fixed"]
    for joint in moving:
        if joint.kind in _REFUSED:
            instead = _tree(robot, above).instead_of(base, tip)
            robot.fail(f"joint {joint.name!r} on the path is {joint.kind}, wanted revolute{instead}", joint)
        _refuse_unless_rotating(robot, joint)
    if len(moving) != JOINTS:
        names = ", ".join(joint.name for joint in moving) or "none"
        instead = _tree(robot, above).instead_of(base, tip)
        robot.fail(f"{len(moving)} moving joints from {base!r} to {tip!r}, wanted {JOINTS}: {names}{instead}")
    chain = chain_along(robot, base, tip, steps, continuous_limits)
    lift = _lift(robot, above, base)
    if lift is not None and lift not in moving:
        chain = replace(chain, notes=(*chain.notes, moved_base(lift.name, base)))
    chain = replace(chain, notes=(*guessed, *chain.notes))
    return chain


def _lift(robot: RobotElement, above: dict[str, JointElement], link: str) -> JointElement | None:
    """Return the nearest joint above a link that moves it, None if the link is fixed."""
    while link in above and above[link].kind == "fixed":
        link, _ = _ends(robot, above[link])
    return above.get(link)


def urdf_text(source: Source) -> tuple[str | bytes, Path]:
    """Return the text of a URDF that `read_urdf` has read, from its first tag on, and its folder."""
    if isinstance(source, bytes):
        return decoded(source.removeprefix(_UTF8_MARK).lstrip())[0], Path()
    if isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        return source.lstrip("\ufeff \t\r\n"), Path()
    return decoded(_bytes_of(source).removeprefix(_UTF8_MARK).lstrip())[0], Path(source).parent


def urdf_candidates(source: Source, base: str | None = None) -> list[Candidate]:
    """Return every chain of seven rotating joints of a file, S-R-S first.

    Parameters and errors are those of :func:`read_urdf`; with ``base`` only chains from there.
    """
    robot = _load(source)
    above = _parents(robot)
    if base is not None and base not in robot.links:
        robot.fail(unknown("link", base, "base", list(robot.links)))
    return find_candidates(_tree(robot, above), _Reader(robot, above), base)


class _Reader:
    """Reads the chain between two links of one robot."""

    def __init__(self, robot: RobotElement, above: dict[str, JointElement]) -> None:
        """Keep the robot and the joint above each link."""
        self.robot = robot
        self.above = above

    def __call__(self, base: str, tip: str) -> Chain:
        return chain_along(self.robot, base, tip, _path(self.robot, self.above, base, tip))


def _load(source: Source) -> RobotElement:
    """Return the links and joints of a file or of XML text."""
    check_source(source, bytes)
    if isinstance(source, bytes):
        return _parse(source, "XML text")
    if isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        return _parse(source, "XML text")
    return _parse(_bytes_of(source), str(Path(source)))


def _bytes_of(path: str | os.PathLike[str]) -> bytes:
    """Return the contents of a file."""

    def fail(why: str) -> NoReturn:
        """Raise the error of this file."""
        raise ModelError(why, source=str(Path(path)))

    return _opening.bytes_of(path, MAX_BYTES, fail)


def _parse(text: str | bytes, source: str) -> RobotElement:
    """Return the links and joints of a document; blank lines before it are permitted."""
    if len(text) > MAX_BYTES:
        raise ModelError(_opening.too_long(len(text), MAX_BYTES), source=source)
    if isinstance(text, str):
        document: str | bytes = text.lstrip("\ufeff \t\r\n")
    else:
        document = text.removeprefix(_UTF8_MARK).lstrip(b" \t\r\n")
    blank = text[: len(text) - len(document)]
    skipped = blank.count("\n") if isinstance(blank, str) else blank.count(b"\n")
    return parse_robot(document, source, skipped)


def _parents(robot: RobotElement) -> dict[str, JointElement]:
    """Return by link name the joint that carries it; raise for two. Joints at missing links are noted."""
    above: dict[str, JointElement] = {}
    for joint in robot.joints.values():
        parent, child = _ends(robot, joint)
        lost = [link for link in (parent, child) if link not in robot.links]
        if lost:
            robot.notes.append(f"joint {joint.name!r} names a link {lost[0]!r} that is not there: left out")
        elif child in above:
            robot.fail(f"link {child!r} hangs on two joints, "
                       f"{above[child].name!r} and {joint.name!r}", joint)  # fmt: skip
        else:
            above[child] = joint
    return above


def _ends(robot: RobotElement, joint: JointElement) -> tuple[str, str]:
    """Return the names of the parent and the child link."""
    names = []
    for part in ("parent", "child"):
        element = joint.parts.get(part)
        if element is None or "link" not in element.attributes:
            robot.fail(f"joint {joint.name!r} has no <{part} link=...>", joint)
        names.append(element.attributes["link"])
    return names[0], names[1]


def _failing(robot: RobotElement) -> Callable[[str], NoReturn]:
    """Return a function that raises the file's error, with a list of joints that were left out."""
    lost = "".join(f"; {note}" for note in robot.notes if "that is not there" in note)
    return lambda message: robot.fail(message + lost)


def _way_up(robot: RobotElement, link: str, above: dict[str, JointElement]) -> list[str]:
    """Return the links from ``link`` to its root, both included."""
    way = {link: None}
    while link in above:
        joint = above[link]
        link, _ = _ends(robot, joint)
        if link in way:
            robot.fail(f"joint {joint.name!r} closes a loop at link {link!r}", joint)
        way[link] = None
    return list(way)


def _path(robot: RobotElement, above: dict[str, JointElement], base: str, tip: str) -> list[Step]:
    """Return the joints from base to tip, each with True if it is followed from parent to child."""
    up, down = (_way_up(robot, link, above) for link in (base, tip))
    if up[-1] != down[-1]:
        _failing(robot)(f"no path from {base!r} to {tip!r}: their roots are {up[-1]!r} and {down[-1]!r}")
    while up and down and up[-1] == down[-1]:
        up.pop()
        down.pop()
    return [(above[link], False) for link in up] + [(above[link], True) for link in down[::-1]]


def _tree(robot: RobotElement, above: dict[str, JointElement]) -> Tree:
    """Return the rigid bodies of the file and the joints between them."""
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
            _way_up(robot, link, above)  # reports the loop to which it belongs
    for child, joint in above.items():
        robot.refuse_expression(joint)
        if joint.kind != "fixed":
            ends = (body_of[_ends(robot, joint)[0]], body_of[child])
            bound = _bound(joint)
            tree.joints.append(TreeJoint(joint.name, joint.kind in _MOVING and not bound, *ends, bound))
    return tree


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
    """Raise for a joint on the path that mimics another or whose type is unknown."""
    robot.refuse_expression(joint)
    bound = _bound(joint)
    if bound:
        robot.fail(f"joint {joint.name!r} on the path {bound}", joint)
