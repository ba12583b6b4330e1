"""Kinematic chains from URDF and back: seven rotating joints on the path from base to tip.

Revolute, continuous and fixed joints count; joints off the path (a gripper, a second arm) are
ignored. What the axes mean is the business of :mod:`armangle.models.detect`.
"""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import UrdfError
from .chain import Chain
from .description import JOINTS
from .urdf_joint import Step, chain_along
from .urdf_write import write_urdf
from .urdf_xml import XACRO_ADVICE, JointElement, RobotElement, parse_robot

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
        robot.fail(
            f"{len(moving)} moving joints from {base!r} to {tip!r}, wanted {JOINTS}: {names}"
        )
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
            pending += [
                (child, count + moved) for child, moved in steps[::-1] if count + moved <= JOINTS
            ]
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
