"""The text of a kinematic URDF."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from xml.etree import ElementTree

from ..._arrays import JOINTS
from ...errors import LimitError
from ..chain import Chain, FloatArray, Joint, chain_of, to_rpy
from ..description import ArmDescription

_WRITTEN_DIGITS = 15


def write_urdf(arm: ArmDescription) -> str:
    """Return the text of a kinematic URDF, from link ``base`` to link ``tip``.

    Reading it gives the same forward kinematics, limits, velocities and joint names. Signs, zeros and lengths
    return in their canonical form (`detect`). Raises `LimitError` if a joint is limited on one side only,
    which URDF cannot express.
    """
    return write_chain(chain_of(arm), arm.name)


def write_chain(chain: Chain, name: str) -> str:
    """Return the text of a kinematic URDF of a chain of seven joints."""
    links = [chain.base, *(f"link_{i}" for i in range(1, JOINTS + 1)), chain.tip]
    robot = ElementTree.Element("robot", name=name or "arm")
    for link in links:
        ElementTree.SubElement(robot, "link", name=link)
    for index, joint in enumerate(chain.joints):
        element = _write_joint(robot, joint.name, _kind(joint), links[index : index + 2])
        _write_origin(element, joint.origin)
        ElementTree.SubElement(element, "axis", xyz=_text(joint.axis))
        _write_limit(element, joint)
    element = _write_joint(
        robot, _free_name("tool", tuple(joint.name for joint in chain.joints)), "fixed", links[-2:]
    )
    _write_origin(element, chain.tip_origin)
    ElementTree.indent(robot)
    return ElementTree.tostring(robot, encoding="unicode", xml_declaration=True) + "\n"


def _write_joint(
    robot: ElementTree.Element, name: str, kind: str, links: Sequence[str]
) -> ElementTree.Element:
    """Append a joint between two links and return it."""
    joint = ElementTree.SubElement(robot, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=links[0])
    ElementTree.SubElement(joint, "child", link=links[1])
    return joint


def _write_origin(joint: ElementTree.Element, frame: FloatArray) -> None:
    """Append an <origin> with a frame's translation (m) and roll, pitch, yaw (rad)."""
    ElementTree.SubElement(joint, "origin", xyz=_text(frame[:3, 3]), rpy=_text(to_rpy(frame)))


def _kind(joint: Joint) -> str:
    """Return ``continuous`` for a joint without limits, else ``revolute``; raise for a limit on one side."""
    limited = [math.isfinite(limit) for limit in (joint.lower, joint.upper)]
    if any(limited) and not all(limited):
        raise LimitError(
            f"joint {joint.name!r} has limits [{joint.lower:g}, {joint.upper:g}]; "
            "URDF cannot say a limit on one side only"
        )
    return "revolute" if all(limited) else "continuous"


def _write_limit(element: ElementTree.Element, joint: Joint) -> None:
    """Append limits and velocity, 0 if unknown; nothing for a continuous joint of unknown velocity."""
    known = math.isfinite(joint.velocity)
    limit = {"effort": "0", "velocity": repr(float(joint.velocity)) if known else "0"}
    if element.get("type") == "revolute":
        limit |= {"lower": repr(float(joint.lower)), "upper": repr(float(joint.upper))}
    if known or element.get("type") == "revolute":
        ElementTree.SubElement(element, "limit", limit)


def _text(values: Iterable[float]) -> str:
    """Return numbers as text, separated by blanks."""
    return " ".join(repr(round(float(value), _WRITTEN_DIGITS) + 0.0) for value in values)


def _free_name(wanted: str, taken: Sequence[str]) -> str:
    """Return ``wanted``, with underscores added while it is taken."""
    while wanted in taken:
        wanted += "_"
    return wanted
