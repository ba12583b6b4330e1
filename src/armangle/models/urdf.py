"""Kinematic chains from URDF and back: seven rotating joints on the path from base to tip.

Revolute, continuous and fixed joints count; joints off the path (a gripper, a second arm) are
ignored. What the axes mean is the business of :mod:`armangle.models.detect`.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from .._arrays import JOINTS
from ..errors import UrdfError
from .chain import Chain, FloatArray, Joint, from_rpy, rigid_inverse
from .urdf_write import write_urdf
from .urdf_xml import XACRO_ADVICE, JointElement, RobotElement, parse_robot

Step = tuple[JointElement, bool]

MAX_LENGTH = 100.0


def chain_along(robot: RobotElement, base: str, tip: str, steps: Sequence[Step]) -> Chain:
    """Return the chain of a path, fixed joints folded into the next frame.

    Parameters
    ----------
    robot : RobotElement
        The file.
    base, tip : str
        The links at the ends of the path.
    steps : sequence of (JointElement, bool)
        Joints from base to tip, each with True where it is walked from parent to child.

    Raises
    ------
    UrdfError
        A zero axis, missing or reversed limits, a number that is none or absurd.
    """
    joints: list[Joint] = []
    notes: list[str] = []
    frame = np.eye(4)
    for element, downward in steps:
        origin = _origin(robot, element)
        frame = frame @ origin if downward else frame
        if element.kind != "fixed":
            axis = _axis(robot, element) * (1.0 if downward else -1.0)
            lower, upper = _limits(robot, element)
            velocity = _velocity(robot, element, notes)
            joints.append(Joint(element.name, frame, axis, lower, upper, velocity))
            frame = np.eye(4)
        frame = frame if downward else frame @ rigid_inverse(origin)
    name = robot.name or "arm"
    return Chain(name, base, tip, tuple(joints), frame, robot.source, tuple(notes))


def _origin(robot: RobotElement, joint: JointElement) -> FloatArray:
    """Return the frame (4, 4) of a joint in its parent link; identity where not given."""
    xyz = robot.numbers(joint, "origin", "xyz", 3)
    rpy = robot.numbers(joint, "origin", "rpy", 3)
    if xyz is not None and np.abs(xyz).max() > MAX_LENGTH:
        robot.fail(
            f"joint {joint.name!r} lies {np.abs(xyz).max():g} m away, absurd for an arm "
            f"(wanted metres, at most {MAX_LENGTH:g})",
            joint.parts["origin"],
        )
    zero = np.zeros(3)
    return from_rpy(zero if xyz is None else xyz, zero if rpy is None else rpy)


def _axis(robot: RobotElement, joint: JointElement) -> FloatArray:
    """Return the unit axis (3,) of a joint; x where not given, as URDF has it."""
    axis = robot.numbers(joint, "axis", "xyz", 3)
    if axis is None:
        return np.array([1.0, 0.0, 0.0])
    largest = np.abs(axis).max()
    if largest == 0.0:
        robot.fail(f"joint {joint.name!r} has a zero axis", joint.parts["axis"])
    scaled = axis / largest
    return np.asarray(scaled / np.linalg.norm(scaled), dtype=np.float64)


def _limits(robot: RobotElement, joint: JointElement) -> tuple[float, float]:
    """Return lower and upper limit, rad; infinite for a continuous joint."""
    if joint.kind == "continuous":
        return float("-inf"), float("inf")
    given = joint.parts["limit"].attributes if "limit" in joint.parts else {}
    if "lower" not in given and "upper" not in given:
        robot.fail(f"revolute joint {joint.name!r} has no limits (lower, upper)", joint)
    lower, upper = (_number(robot, joint, key) or 0.0 for key in ("lower", "upper"))
    if lower > upper:
        robot.fail(
            f"joint {joint.name!r}: lower limit {lower:g} is above upper limit {upper:g}",
            joint.parts["limit"],
        )
    return lower, upper


def _velocity(robot: RobotElement, joint: JointElement, notes: list[str]) -> float:
    """Return the greatest speed, rad/s; infinite where missing or zero."""
    velocity = _number(robot, joint, "velocity")
    if velocity is None:
        return float("inf")
    if velocity < 0.0:
        robot.fail(f"joint {joint.name!r}: velocity {velocity:g} is negative", joint.parts["limit"])
    if velocity == 0.0:
        notes.append(f"velocity of joint {joint.name!r} is 0: taken as not given")
        return float("inf")
    return velocity


def _number(robot: RobotElement, joint: JointElement, key: str) -> float | None:
    """Return one number of the joint's limit, None where it is not given."""
    values = robot.numbers(joint, "limit", key, 1)
    return None if values is None else float(values[0])


__all__ = ["MAX_BYTES", "Source", "read_urdf", "urdf_candidates", "write_urdf"]

Source = str | bytes | os.PathLike[str]

MAX_BYTES = 32 * 2**20

_MOVING = ("revolute", "continuous")
_REFUSED = ("prismatic", "floating", "planar")


def read_urdf(source: Source, base: str | None = None, tip: str | None = None) -> Chain:
    """Return the chain of seven joints from base link to tip link.

    Parameters
    ----------
    source : str, bytes or path
        A file, or the XML text itself (bytes, or a str that begins with ``<``).
    base, tip : str, optional
        Link names. What is left out is guessed, and refused if the guess is not unique:
        :func:`urdf_candidates` lists the choices.

    Returns
    -------
    Chain
        In the file's own frames and joint coordinates; a continuous joint has no limits.

    Raises
    ------
    UrdfError
        With file, line and column, and the name of the link or joint.
    """
    robot = _load(source)
    if base is None or tip is None:
        base, tip = _guess(robot, base, tip)
    steps = _path(robot, base, tip)
    moving = [joint for joint, _ in steps if joint.kind != "fixed"]
    for joint in moving:
        _refuse_unless_rotating(robot, joint)
    if len(moving) != JOINTS:
        names = ", ".join(joint.name for joint in moving) or "none"
        robot.fail(f"{len(moving)} moving joints from {base!r} to {tip!r}, wanted {JOINTS}: {names}")
    return chain_along(robot, base, tip, steps)


def urdf_candidates(source: Source) -> tuple[tuple[str, str], ...]:
    """Return the pairs (base, tip) with exactly seven rotating joints between, in file order.

    The base is a root link; the tip is reached through seven moving joints and carries no further
    fixed link. Parameters and errors are those of :func:`read_urdf`.
    """
    return tuple(_candidates(_load(source)))


def _load(source: Source) -> RobotElement:
    """Return the links and joints of a file or of XML text."""
    if isinstance(source, bytes):
        return _parse(source, "XML text")
    if isinstance(source, str) and source.lstrip("\ufeff \t\r\n").startswith("<"):
        return _parse(source.lstrip("\ufeff \t\r\n"), "XML text")
    path = Path(source)
    if path.suffix == ".xacro":
        raise UrdfError(f"this is xacro, not URDF; {XACRO_ADVICE}", source=str(path))
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UrdfError(_too_large(path.stat().st_size), source=str(path))
        return _parse(path.read_bytes(), str(path))
    except FileNotFoundError:
        raise UrdfError("no such file", source=str(path)) from None
    except UrdfError:
        raise
    except ValueError as error:  # a name that no file can have
        raise UrdfError(f"cannot be read: {error}", source=repr(str(path))) from None
    except OSError as error:
        raise UrdfError(f"cannot be read: {error.strerror}", source=str(path)) from error


def _parse(text: str | bytes, source: str) -> RobotElement:
    if len(text) > MAX_BYTES:
        raise UrdfError(_too_large(len(text)), source=source)
    return parse_robot(text, source)


def _too_large(size: int) -> str:
    return f"{size / 2**20:.0f} MiB is absurd for a robot, wanted at most {MAX_BYTES >> 20} MiB"


def _parents(robot: RobotElement) -> dict[str, JointElement]:
    """Return the joint above each link that has one."""
    above: dict[str, JointElement] = {}
    for joint in robot.joints.values():
        parent, child = _ends(robot, joint)
        for link in (parent, child):
            if link not in robot.links:
                robot.fail(f"joint {joint.name!r} names a link {link!r} that is not there", joint)
        if child in above:
            robot.fail(f"link {child!r} hangs on two joints, "
                       f"{above[child].name!r} and {joint.name!r}", joint)  # fmt: skip
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


def _path(robot: RobotElement, base: str, tip: str) -> list[Step]:
    """Return the joints from base to tip, each with True where it is walked parent to child."""
    for role, link in (("base", base), ("tip", tip)):
        if link not in robot.links:
            robot.fail(f"no link {link!r} ({role}); the links are: {', '.join(robot.links)}")
    above = _parents(robot)
    up, down = (_way_up(robot, link, above) for link in (base, tip))
    if up[-1] != down[-1]:
        robot.fail(f"no path from {base!r} to {tip!r}: their roots are {up[-1]!r} and {down[-1]!r}")
    while up and down and up[-1] == down[-1]:
        up.pop()
        down.pop()
    return [(above[link], False) for link in up] + [(above[link], True) for link in down[::-1]]


def _guess(robot: RobotElement, base: str | None, tip: str | None) -> tuple[str, str]:
    """Return base and tip, the missing ones guessed."""
    if tip is not None:
        if tip not in robot.links:
            robot.fail(f"no link {tip!r} (tip); the links are: {', '.join(robot.links)}")
        return _way_up(robot, tip, _parents(robot))[-1], tip
    if base is not None and base not in robot.links:
        robot.fail(f"no link {base!r} (base); the links are: {', '.join(robot.links)}")
    found = _candidates(robot, base)
    if not found:
        robot.fail(
            f"no link is reached through exactly {JOINTS} rotating joints"
            f"{f' from {base!r}' if base else ''}; name base and tip among the links: "
            f"{', '.join(robot.links)}"
        )
    if len(found) > 1:
        pairs = ", ".join(f"{first!r} to {last!r}" for first, last in found)
        robot.fail(f"base and tip are not unique, name them; candidates: {pairs}")
    return found[0]


def _candidates(robot: RobotElement, base: str | None = None) -> list[tuple[str, str]]:
    """Return (base, tip) pairs, from the given base or from every root."""
    above = _parents(robot)
    below: dict[str, list[tuple[JointElement, str]]] = {link: [] for link in robot.links}
    for child, joint in above.items():
        below[_ends(robot, joint)[0]].append((joint, child))
    roots = [link for link in robot.links if link not in above]
    if base is not None:
        _way_up(robot, base, above)
        roots = [base]
    pairs: list[tuple[str, str]] = []
    for root in roots:
        pending = [(root, 0)]
        while pending:
            link, count = pending.pop()
            steps = [(child, int(joint.kind != "fixed")) for joint, child in below[link]
                     if joint.kind == "fixed" or _rotates(joint)]  # fmt: skip
            if count == JOINTS and all(moved for _, moved in steps):
                pairs.append((root, link))
            pending += [(child, count + moved) for child, moved in steps[::-1] if count + moved <= JOINTS]
    return pairs


def _rotates(joint: JointElement) -> bool:
    return joint.kind in _MOVING and "mimic" not in joint.parts


def _refuse_unless_rotating(robot: RobotElement, joint: JointElement) -> None:
    """Refuse a joint on the path that is not a free rotation."""
    if joint.kind in _REFUSED:
        robot.fail(f"joint {joint.name!r} on the path is {joint.kind}, wanted revolute", joint)
    if joint.kind not in _MOVING:
        robot.fail(f"joint {joint.name!r} on the path has unknown type {joint.kind!r}", joint)
    if "mimic" in joint.parts:
        robot.fail(f"joint {joint.name!r} on the path mimics another joint", joint)
