"""Arguments that commands share, and what they stand for."""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from .._arrays import JOINTS, TURN, Floats, number_in
from ..arm.arm import MOST_MARGIN, Arm
from ..arm.offset import OffsetArm
from ..arm.roll import ROLLS
from ..errors import InputError, ModelError, SceneError
from ..files.scenes import load_body, load_scene
from ..files.sheets import ending
from ..files.tables import load_poses
from ..models.axes import MAX_ANGLE, MAX_LENGTH
from ..models.body import BARE, Body
from ..models.catalogue import read_robot
from ..models.mjcf import is_mjcf
from ..models.offset import offset_catalogue
from ..poses import COLUMNS, UNIT_TOLERANCE, poses_from_rows
from ..scenes.scene import Scene
from ..scenes.shapes import Ball, Capsule, Shape
from .messages import note
from .screen import called, progress

DEGREE = math.pi / 180
_THINNEST = 1e-3  # m: no arm's links and no hand are as thin
_LONGEST = 5.0  # m: no tool is as long
_PLACE = COLUMNS[:3]
AnyArm = TypeVar("AnyArm", Arm, OffsetArm)
_FILES = (".csv", ".npz", ".json")
POSE_HELP = "x,y,z,qw,qx,qy,qz: metres and a unit quaternion"


def add_arm(parser: argparse.ArgumentParser, *, required: bool = True) -> None:
    """Add --robot, --urdf, --base and --tip, and what `add_import` adds."""
    group = parser.add_argument_group("the arm")
    one = group.add_mutually_exclusive_group(required=required)
    one.add_argument("--robot", metavar="NAME", help="of the catalogue (armangle robots), or a FILE.toml")
    one.add_argument("--urdf", metavar="FILE", help="a robot description: URDF or MJCF (.xml)")
    group.add_argument("--base", metavar="LINK", help="with --urdf: first link; guessed if left out")
    group.add_argument("--tip", metavar="LINK", help="with --urdf: last link; guessed if left out")
    group.add_argument(
        "--tool", metavar="TOOL",
        help="x,y,z or x,y,z,qw,qx,qy,qz: a tool on the tip, m and a unit quaternion; poses are its",
    )  # fmt: skip
    add_import(group, "with --urdf: ")


def add_import(parser: argparse.ArgumentParser | argparse._ArgumentGroup, when: str = "") -> None:
    """Add --inexact, --length-tolerance, --angle-tolerance and --continuous-limits, for files of robots."""
    parser.add_argument(
        "--inexact", action="store_true", default=None,
        help=f"{when}keep the chain of a file that is only nearly S-R-S, as a calibrated robot's",
    )  # fmt: skip
    parser.add_argument(
        "--length-tolerance", type=length_up_to(MAX_LENGTH), metavar="MM",
        help="take an arm whose axes miss shoulder, elbow or wrist by up to this; the fitted one",
    )  # fmt: skip
    parser.add_argument(
        "--angle-tolerance", type=angle_up_to(MAX_ANGLE), metavar="DEG",
        help="take an arm whose neighbouring axes are not square by up to this; the fitted one",
    )  # fmt: skip
    parser.add_argument(
        "--continuous-limits", choices=("ignore", "use"), default="ignore",
        help="limits that a continuous joint of a URDF states (default ignore)",
    )  # fmt: skip


def add_scene(parser: argparse.ArgumentParser) -> None:
    """Add --scene, --body, --hand and --clearance."""
    group = parser.add_argument_group("obstacles")
    group.add_argument(
        "--scene", metavar="FILE", help="keep clear of what it holds: scene.toml, or MoveIt's .scene"
    )
    group.add_argument(
        "--body", metavar="BODY",
        help="with --scene, the arm's links: UPPER,FOREARM radii in mm, body.toml, a URDF or "
        "MJCF with collision shapes (default: the file of --urdf), or guessed: from its lengths",
    )  # fmt: skip
    group.add_argument(
        "--hand", metavar="HAND",
        help="with --scene, what the tip carries: the RADIUS in mm of a rod from there to the place of "
        "--tool (a ball without it), or hand.toml: balls, capsules, boxes and hulls as in scene.toml, "
        "in the frame of the tool",
    )  # fmt: skip
    group.add_argument(
        "--clearance", type=number, metavar="MM",
        help="kept from all obstacles (default: what the scene says)",
    )  # fmt: skip


def add_roll(parser: argparse.ArgumentParser) -> None:
    """Add --roll."""
    parser.add_argument(
        "--roll", choices=ROLLS, default="pose",
        help="free: for tools that may turn about their z axis (default pose)",
    )  # fmt: skip


def any_arm_and_scene(args: argparse.Namespace) -> tuple[Arm | OffsetArm, Scene | None]:
    """Return `any_arm`, of an `Arm` with body and hand, and the scene of --scene."""
    arm = any_arm(args)
    if isinstance(arm, Arm):
        return with_body(arm, args)
    for option in ("scene", "body", "hand", "clearance"):
        if getattr(args, option) is not None:
            raise InputError(f"--{option} does not go with {called(arm)}")
    return arm, None


def with_body(arm: Arm, args: argparse.Namespace) -> tuple[Arm, Scene | None]:
    """Return the arm with the body of --body and the hand of --hand, and the scene of --scene."""
    if args.scene is None:
        for option in ("body", "hand", "clearance"):
            if getattr(args, option) is not None:
                raise InputError(f"--{option} goes with --scene")
        return arm, None
    scene = load_scene(args.scene)
    if args.clearance is not None:
        kept = args.clearance / 1e3
        scene = Scene(scene.shapes, clearance=kept, soft=scene.soft, ignore=scene.ignore)
    if args.hand is not None:
        arm = arm.with_hand(_hand(args))
    arm = _bodied(arm, args)
    for line in () if arm.body is None else arm.body.notes:
        if not line.startswith(BARE):
            note(f"armangle: {line}")
        elif args.hand is None:
            note(f"armangle: {BARE}: --hand does")
    _refuse_unusable(arm, scene, args.scene)
    return arm, scene


def _bodied(arm: Arm, args: argparse.Namespace) -> Arm:
    """Return the arm with the body of --body, or of --urdf's file."""
    text = args.urdf if args.body is None else args.body
    if text is None:
        raise InputError(
            "--scene needs the shape of the arm's links: --body 90,80 (radii of the bones in mm), or guessed"
        )
    if text == "guessed":
        return arm.with_body()
    links = (args.base, args.tip) if args.urdf is not None else (None, None)
    if Path(text).suffix.lower() == ".toml":
        return arm.with_body(load_body(text))
    if not Path(text).is_file():
        upper_arm, forearm = radii = numbers("--body", text, "UPPER,FOREARM in mm, or a file", 2) / 1e3
        _refuse_metres("--body", text, radii)
        return arm.with_body(Body.bones(upper_arm=float(upper_arm), forearm=float(forearm)))
    from_file = Body.from_mjcf if is_mjcf(text) else Body.from_urdf
    return arm.with_body(from_file(text, *links, exact=not args.inexact))


def _hand(args: argparse.Namespace) -> tuple[Shape, ...]:
    """Return the shapes of --hand, in the tool frame."""
    text = args.hand
    if Path(text).suffix.lower() == ".toml":
        held = load_scene(text)
        if held.clearance or held.soft or held.ignore:
            raise InputError(f"{text}: clearance, soft and ignore are of the scene, not of a hand")
        return held.shapes
    radius = numbers("--hand", text, "a RADIUS in mm, or hand.toml", 1) / 1e3
    _refuse_metres("--hand", text, radius)
    if args.tool is None:
        return (Ball([0.0, 0.0, 0.0], float(radius[0])),)
    tool = _tool(args)
    return (Capsule(-tool[:3, :3].T @ tool[:3, 3], [0.0, 0.0, 0.0], float(radius[0])),)


def _refuse_metres(option: str, text: str, radii: Floats) -> None:
    if 0 < np.max(radii) < _THINNEST:
        raise InputError(f"{option} is {text}, in mm: was this in m?")


def _refuse_unusable(arm: Arm, scene: Scene, file: str) -> None:
    """Refuse a scene that does not fit the arm, with its file's name; what is made ready here is kept."""
    try:
        arm._scene(scene)
    except SceneError as error:
        raise InputError(f"{file}: {error}") from None


def add_json(parser: argparse.ArgumentParser) -> None:
    """Add --json."""
    parser.add_argument("--json", action="store_true", help="print JSON, in radians, for scripts")


def add_singularity_margin(parser: argparse.ArgumentParser) -> None:
    """Add --singularity-margin."""
    parser.add_argument(
        "--singularity-margin", type=angle_up_to(MOST_MARGIN), default=0.0, metavar="DEG",
        help="keep joints 2, 6 and the elbow this far from singular (default 0)",
    )  # fmt: skip


def add_output(parser: argparse.ArgumentParser, what: str, more: str = "") -> None:
    """Add -o for what is saved by its ending; `more` names endings beyond those that all have."""
    endings = f".csv, .npz, .json{more}" if more else ".csv, .npz or .json"
    parser.add_argument("-o", "--output", type=_output, metavar="FILE", help=f"write the {what}: {endings}")


def _output(text: str) -> str:
    """Return the name of a file that can be saved, for argparse: better said before long work than after."""
    try:
        ending(text)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def the_arm(args: argparse.Namespace) -> Arm:
    """Return the arm that --robot or --urdf names, with the tool of --tool."""
    return _tooled(_bare_arm(args), args)


def _tooled(arm: AnyArm, args: argparse.Namespace) -> AnyArm:
    """Return the arm with the tool of --tool on its tip."""
    return arm if args.tool is None else arm.with_tool(_tool(args))


def _tool(args: argparse.Namespace) -> Floats:
    """Return the frame of --tool in the tip's, (4, 4)."""
    given = len(args.tool.replace(",", " ").split())
    if given not in (len(_PLACE), len(COLUMNS)):
        raise InputError(f"--tool has {given} numbers, wanted x,y,z or {','.join(COLUMNS)}")
    turned = "" if given == len(COLUMNS) else ",1,0,0,0"
    tool = pose("--tool", args.tool + turned)
    if np.abs(tool[:3, 3]).max() > _LONGEST:
        raise InputError(f"--tool is {args.tool}, a place in m: was this in mm?")
    return tool


def _bare_arm(args: argparse.Namespace) -> Arm:
    """Return the arm that --robot or --urdf names."""
    if args.urdf is not None:
        return arm_of_file(args.urdf, args.base, args.tip, args)
    for option in ("base", "tip", "inexact", "length_tolerance", "angle_tolerance"):
        if getattr(args, option) is not None:
            raise InputError(f"--{option.replace('_', '-')} goes with --urdf, not with --robot")
    if Path(args.robot).suffix.lower() in (".urdf", ".xml", ".mjcf", ".xacro"):
        raise InputError(f"--robot names an arm of the catalogue, or a FILE.toml: --urdf {args.robot}")
    if Path(args.robot).suffix == ".toml":
        return Arm._from_description(read_robot(args.robot).description)
    return Arm.from_catalogue(args.robot)


def any_arm(args: argparse.Namespace) -> Arm | OffsetArm:
    """Return the arm that --robot or --urdf names, be it one with an offset wrist or shoulder."""
    try:
        return the_arm(args)
    except (ModelError, InputError):
        if args.urdf is None and args.robot in offset_catalogue():
            return _tooled(OffsetArm.from_catalogue(args.robot), args)
        if args.urdf is None:
            raise
        try:
            return _tooled(offset_arm_of_file(args.urdf, args.base, args.tip, args), args)
        except ModelError:
            pass
        raise


def arm_of_file(
    file: str, base: str | None, tip: str | None, args: argparse.Namespace, *, show_notes: bool = True
) -> Arm:
    """Return the arm between two links of a URDF or bodies of an MJCF, by the options of `add_import`."""
    inexact = {"exact": False} if args.inexact else {}
    return _read(Arm, file, {"base": base, "tip": tip, **inexact}, args, show_notes)


def offset_arm_of_file(
    file: str, base: str | None, tip: str | None, args: argparse.Namespace, *, show_notes: bool = True
) -> OffsetArm:
    """Return the arm with an offset wrist or shoulder of a file, as `arm_of_file` returns an `Arm`."""
    arm = _read(OffsetArm, file, {"base": base, "tip": tip}, args, show_notes)
    if args.inexact:
        raise InputError(
            f"--inexact does not go with {arm.name}, an OffsetArm, beside which no chain is kept: "
            "--length-tolerance and --angle-tolerance take the nearest"
        )
    return arm


def _read(
    kind: type[AnyArm], file: str, options: dict[str, Any], args: argparse.Namespace, show_notes: bool
) -> AnyArm:
    """Return the arm of a file; what its reader warns of is said once it is read."""
    given = {key: getattr(args, key) for key in ("length_tolerance", "angle_tolerance")}
    options = options | {key: value for key, value in given.items() if value is not None}
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        if is_mjcf(file):
            arm: AnyArm = kind.from_mjcf(file, **options)
        else:
            arm = kind.from_urdf(file, continuous_limits=args.continuous_limits, **options)
    for warning in caught if show_notes else ():
        warnings.warn(warning.message, stacklevel=2)
    return arm


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


def length_up_to(highest: float) -> Callable[[str], float]:
    """Return what reads millimetres as m, for argparse, from 0 to `highest` m."""

    def read(text: str) -> float:
        value = number(text) / 1e3
        if not 0 <= value <= highest:
            raise argparse.ArgumentTypeError(f"{text.strip()} mm, wanted 0 to {1e3 * highest:g} mm")
        return value

    return read


def angle_up_to(highest: float, *, positive: bool = False) -> Callable[[str], float]:
    """Return what reads degrees as rad, for argparse, from 0 (left out where `positive`) to `highest` rad."""
    least = "more than 0" if positive else "0"
    most = f" to {highest / DEGREE:.4g}" if math.isfinite(highest) else ""

    def read(text: str) -> float:
        value = angle(text)
        if not 0 <= value <= highest or (positive and value == 0):
            raise argparse.ArgumentTypeError(f"{text.strip()} deg, wanted {least}{most} deg")
        return value

    return read


def numbers(name: str, text: str, wanted: str, count: int) -> Floats:
    """Return `count` numbers that are separated by commas or blanks."""
    values = []
    for word in text.replace(",", " ").split():
        try:
            values.append(number(word))
        except argparse.ArgumentTypeError as error:
            raise InputError(f"{name}: {error}, wanted {wanted}") from None
    if len(values) != count:
        raise InputError(f"{name} has {len(values)} numbers, wanted {count}: {wanted}")
    return np.array(values)


def add_wish(group: Any, of: str = "") -> None:
    """Add what may be wished of the arm angle; `of` says with what it goes."""
    group.add_argument("--psi", type=angle, metavar="DEG", help=f"{of}this arm angle")
    group.add_argument("--point", metavar="X,Y,Z", help=f"{of}the elbow near this, m")
    group.add_argument("--direction", metavar="D", help=f"{of}the elbow far up, down, left, ... or x,y,z")


def wish(given: dict[str, Any]) -> dict[str, Any]:
    """Return options by name, those that hold a point or a direction read from their text."""
    read = dict(given)
    for name in given.keys() & {"point", "direction"}:
        if name == "point" or "," in given[name]:
            read[name] = numbers(f"--{name}", given[name], "x,y,z", 3)
    return read


def joints(name: str, text: str, arm: Arm | OffsetArm | None = None) -> Floats:
    """Return seven joint values given in degrees, rad: not more than a turn outside the limits of `arm`."""
    given = numbers(name, text, "q1,..,q7 in degrees", JOINTS)
    if 0 < np.abs(given).max() <= TURN and (given % 1).any():
        note(f"armangle: {name} is in degrees, the largest is {np.abs(given).max():.4g}: were these rad?")
    q = given * DEGREE
    outside = np.zeros(JOINTS) if arm is None else np.maximum(arm.lower - q, q - arm.upper)
    at = int(outside.argmax())
    if outside[at] > TURN:
        beyond = f"{q[at] / DEGREE:g} deg, {outside[at] / DEGREE:.4g} deg outside its limits"
        raise InputError(f"{name}: joint {at + 1} is {beyond}, wanted less than a turn")
    return q


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


def some_poses(path: str, *, lost: bool = False) -> Floats:
    """Return the poses of a file, (N, 4, 4), one or more; NaN those that are lost, where they may be.

    Raises
    ------
    InputError, ModelError
    """
    with progress(f"reading {path}"):
        frames = load_poses(path, lost=lost)
    if not np.isfinite(frames).any():
        raise InputError(f"{path} holds no pose, wanted at least one")
    return frames


def poses(name: str, text: str) -> Floats:
    """Return one pose (4, 4) of seven numbers, or the poses (N, 4, 4) of a file."""
    return load_poses(text) if is_file(text) else pose(name, text)


def is_file(text: str) -> bool:
    """Return whether a word names a file rather than numbers."""
    return Path(text).suffix.lower() in _FILES or Path(text).is_file()


def joint_bounds(name: str, text: str | None, unit: str, stated: Floats) -> Floats:
    """Return one number, or seven, of degrees as (7,) in rad; what the arm states where there is none."""
    if text is None:
        return stated
    count = len(text.replace(",", " ").split())
    found = numbers(name, text, f"one number or {JOINTS}, {unit}", count if count == 1 else JOINTS)
    if not (found > 0).all():
        raise InputError(f"{name} holds {found.min():g}, wanted numbers > 0 in {unit}")
    return np.broadcast_to(found * DEGREE, (JOINTS,)).copy()
