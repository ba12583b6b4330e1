"""The options, each defined once, and the parsers of their values."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import CONFIGURATIONS, JOINTS, TURN, Floats, number_in
from ..arm.arm import MOST_MARGIN, Arm
from ..arm.roll import ROLLS
from ..errors import InputError
from ..files.sheets import ending
from ..files.tables import load_joints, load_poses
from ..poses import COLUMNS, UNIT_TOLERANCE, poses_from_rows
from .messages import note
from .screen import progress, violations

DEGREE = math.pi / 180
_FILES = (".csv", ".npz", ".json")
_POSE = "x,y,z,qw,qx,qy,qz (m, unit quaternion)"
_Q = "q1,..,q7 in degrees"


def number(text: str) -> float:
    """Return a finite number, for argparse."""
    try:
        value = number_in(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text.strip()!r} is not a number") from None
    if not math.isfinite(value):
        raise argparse.ArgumentTypeError(f"{text.strip()!r} is not finite")
    return value


def angle(text: str) -> float:
    """Return degrees as rad, for argparse."""
    return number(text) * DEGREE


def within(highest: float, unit: float, name: str, *, positive: bool = False) -> Callable[[str], float]:
    """Return a parser for argparse: of 0 (excluded if `positive`) to `highest`, returned times `unit`."""
    least = "more than 0" if positive else "0"
    most = f" to {highest:.4g}" if math.isfinite(highest) else ""

    def read(text: str) -> float:
        """Return a number times the unit; raise unless it is in the range."""
        value = number(text)
        if not 0 <= value <= highest or (positive and value == 0):
            raise argparse.ArgumentTypeError(f"{text.strip()} {name}, wanted {least}{most} {name}")
        return value * unit

    return read


def _output(text: str) -> str:
    """Return the name of a file that can be saved, for argparse: a bad name fails before long work."""
    try:
        ending(text)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


OPTIONS: dict[str, dict[str, Any]] = {
    # the arm
    "robot": {"metavar": "ARM", "help": "name of the catalogue (armangle robots), or a URDF, MJCF or TOML"},
    "links": {"metavar": "BASE,TIP",
        "help": "first and last link of a file, also BASE, or ,TIP (default: guessed)"},
    "tool": {"metavar": "TOOL", "help": f"tool frame on the tip: x,y,z or {_POSE}"},
    # obstacles
    "scene": {"metavar": "FILE", "help": "avoid these obstacles: scene.toml, or a MoveIt .scene"},
    "body": {"metavar": "BODY", "help": "with --scene, collision model: UPPER,FOREARM radii in mm, "
             "body.toml, a URDF or MJCF (default: the file of --robot), or guessed"},
    "gripper": {"metavar": "GRIPPER",
        "help": "with --scene, tool geometry: RADIUS in mm of a rod from the tip "
                "to the tool frame, or gripper.toml with shapes in the tool frame"},
    "clearance": {"type": number, "metavar": "MM", "help": "distance to obstacles (default: of the scene)"},
    # targets
    "joints": {"metavar": "Q", "help": f"{_Q}, or a joint FILE in rad"},
    "psi": {"type": angle, "metavar": "DEG", "help": "arm angle, or joint 1 or 7 of an arm with an offset"},
    "gc": {"type": int, "choices": range(CONFIGURATIONS), "help": "global configuration, a branch"},
    "roll": {"choices": ROLLS, "default": "pose", "help": "free: the tool may turn around its z axis"},
    "singularity-margin": {
        "type": within(MOST_MARGIN / DEGREE, DEGREE, "deg"), "default": 0.0, "metavar": "DEG",
        "help": "distance of joints 2, 6 and the elbow to their singularities (default 0)"},
    # motions
    "start": {"metavar": "Q", "help": f"{_Q}: the joints at the start of the motion"},
    "velocity": {"metavar": "V", "help": "bound of the joints, deg/s (default: the arm's own)"},
    "acceleration": {"metavar": "A", "help": "bound of the joints, deg/s^2 (default: the arm's own)"},
    # results
    "output": {"type": _output, "metavar": "FILE", "help": "write the result: .csv, .npz or .json"},
    "plot": {"metavar": "FILE", "help": "draw the result: .png, .svg or .pdf"},
    "json": {"action": "store_true", "help": "print JSON, in radians, for scripts"},
}  # fmt: skip
"""The argparse arguments of every option that more than one command has."""

ARM = ("robot", "links", "tool")
SCENE = ("scene", "body", "gripper", "clearance")


def add(parser: Any, *names: str, **changes: Any) -> None:
    """Add options of `OPTIONS` by name; `changes` replace their arguments for one command."""
    for name in names:
        words = ("-o", "--output") if name == "output" else (f"--{name}",)
        parser.add_argument(*words, **(OPTIONS[name] | changes))


def add_arm(parser: argparse.ArgumentParser, *more: str, required: bool = True) -> None:
    """Add the options of the arm, and those of `more` in the same group."""
    group = parser.add_argument_group("the arm")
    add(group, "robot", required=required)
    add(group, *ARM[1:], *more)


def add_scene(parser: argparse.ArgumentParser) -> None:
    """Add the options of obstacles."""
    add(parser.add_argument_group("obstacles"), *SCENE)


def given(args: argparse.Namespace, names: Iterable[str]) -> list[str]:
    """Return which of the options differ from their default."""
    values = {name: getattr(args, name.replace("-", "_"), None) for name in names}
    unset = {name: OPTIONS.get(name, {}).get("default") for name in values}
    return [
        name
        for name, value in values.items()
        if value is not None and value is not False and value != unset[name]
    ]


def refuse(args: argparse.Namespace, names: Iterable[str], with_what: str) -> None:
    """Raise if one of the options is given together with something incompatible."""
    for name in given(args, names):
        raise InputError(f"--{name} does not go with {with_what}")


def numbers(name: str, text: str, wanted: str, count: int) -> Floats:
    """Return `count` numbers separated by commas or blanks."""
    values = []
    for word in text.replace(",", " ").split():
        try:
            values.append(number(word))
        except argparse.ArgumentTypeError as error:
            raise InputError(f"{name}: {error}, wanted {wanted}") from None
    if len(values) != count:
        raise InputError(f"{name} has {len(values)} numbers, wanted {count}: {wanted}")
    return np.array(values)


def joints(name: str, text: str, arm: Arm | None = None) -> Floats:
    """Return seven joint values given in degrees, rad: not more than a turn outside the limits of `arm`."""
    values = numbers(name, text, _Q, JOINTS)
    if 0 < np.abs(values).max() <= TURN and (values % 1).any():
        note(f"armangle: {name} is in degrees, the largest is {np.abs(values).max():.4g}: were these rad?")
    q = values * DEGREE
    outside = np.zeros(JOINTS) if arm is None else np.maximum(arm.lower - q, q - arm.upper)
    at = int(outside.argmax())
    if outside[at] > TURN:
        beyond = f"{q[at] / DEGREE:g} deg, {outside[at] / DEGREE:.4g} deg outside its limits"
        raise InputError(f"{name}: joint {at + 1} is {beyond}, wanted less than a turn")
    return q


def start_joints(text: str, arm: Arm) -> Floats:
    """Return the joints of --start, rad; raise if they are outside the limits of the arm."""
    start = joints("--start", text)
    if not arm.within_limits(start):
        raise InputError(f"--start is outside the limits: {violations(arm, start)}")
    return start


def pose(name: str, text: str) -> Floats:
    """Return the pose (4, 4) of seven numbers."""
    row = numbers(name, text, ",".join(COLUMNS), len(COLUMNS))
    length = float(np.linalg.norm(row[3:]))
    if abs(length - 1) > UNIT_TOLERANCE:
        hint = f"; made unit it is {','.join(f'{v:.8g}' for v in row[3:] / length)}" if length else ""
        raise InputError(
            f"{name}: the quaternion has length {length:.7g}, wanted 1 within {UNIT_TOLERANCE:g}{hint}"
        )
    frame: Floats = poses_from_rows(row[None])[0]
    return frame


def poses(name: str, text: str) -> Floats:
    """Return one pose (4, 4) of seven numbers, or the poses (N, 4, 4) of a file."""
    return load_poses(text) if is_file(text) else pose(name, text)


def some_poses(path: str, *, lost: bool = False) -> Floats:
    """Return the poses of a file, (N, 4, 4), one or more; if `lost`, NaN for those that are missing."""
    with progress(f"reading {path}"):
        frames = load_poses(path, lost=lost)
    if not np.isfinite(frames).any():
        raise InputError(f"{path} holds no pose, wanted at least one")
    return frames


def some_joints(path: str) -> Floats:
    """Return the joints of a file without gaps, (N, 7), rad."""
    q = load_joints(path).q
    if not np.isfinite(q).all():
        row = int(np.argmax(~np.isfinite(q).all(axis=1)))
        raise InputError(f"{path}: row {row} has no joint values, wanted a motion without gaps")
    return q


def is_file(text: str) -> bool:
    """Return whether a word names a file of poses or joints instead of numbers."""
    return Path(text).suffix.lower() in _FILES or Path(text).is_file()


def joint_bounds(name: str, text: str | None, unit: str, stated: Floats) -> Floats:
    """Return one number, or seven, of degrees as (7,) in rad, > 0; without text `stated`, in rad."""
    if text is None:
        return stated
    count = len(text.replace(",", " ").split())
    found = numbers(name, text, f"one number or {JOINTS}, {unit}", count if count == 1 else JOINTS)
    if not (found > 0).all():
        raise InputError(f"{name} holds {found.min():g}, wanted numbers > 0 in {unit}")
    return np.broadcast_to(found * DEGREE, (JOINTS,)).copy()
