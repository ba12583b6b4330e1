"""The numbers of URDF joints on a path, checked, as a chain."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .chain import Chain, FloatArray, Joint, from_rpy, rigid_inverse
from .urdf_xml import JointElement, RobotElement

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
