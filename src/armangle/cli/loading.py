"""The arm of --robot and the scene of --scene: all library calls that read them."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from .._arrays import Floats
from ..arm.arm import Arm
from ..errors import InputError, ModelError, SceneError
from ..files.scenes import load_body, load_scene
from ..models.axes import MAX_ANGLE, MAX_LENGTH
from ..models.body import BARE, Body
from ..models.candidates import chosen
from ..models.catalogue import read_robot
from ..models.mjcf import MjcfModel, is_mjcf
from ..models.urdf import UrdfModel
from ..poses import COLUMNS
from ..scenes.scene import Scene
from ..scenes.shapes import Ball, Capsule, Shape
from .arguments import DEGREE, SCENE, given, numbers, pose, refuse
from .messages import note
from .screen import called

_THINNEST = 1e-3  # m: links and grippers are thicker
_LONGEST = 5.0  # m: tools are shorter
_DESCRIPTIONS = (".urdf", ".xml", ".mjcf", ".xacro")
_FITS = ("own", "srs")


def any_arm(args: argparse.Namespace, *, quiet: bool = False) -> Arm:
    """Return the arm of --robot, of any kind, with --tool and --singularity-margin."""
    arm = _bare_arm(args, quiet=quiet)
    if args.tool is not None:
        arm = arm.with_tool(_tool(args.tool))
    return arm.with_(singularity_margin=getattr(args, "singularity_margin", 0.0))


def with_scene(args: argparse.Namespace) -> Arm:
    """Return the arm of `any_arm`; with --scene it has that, a collision model and tool geometry."""
    arm = any_arm(args)
    if args.scene is None:
        for option in given(args, SCENE):
            raise InputError(f"--{option} goes with --scene")
        return arm
    scene = load_scene(args.scene)
    if args.clearance is not None:
        kept = args.clearance / 1e3
        scene = Scene(scene.shapes, clearance=kept, soft=scene.soft, ignore=scene.ignore)
    if args.gripper is not None:
        arm = arm.with_(hand=_gripper(args))
    arm = _with_body(arm, args)
    for line in () if arm.body is None else arm.body.notes:
        if not line.startswith(BARE):
            note(f"armangle: {line}")
        elif args.gripper is None:
            note(f"armangle: {BARE}: --gripper does")
    try:
        return arm.with_(scene=scene)
    except SceneError as error:
        raise InputError(f"{args.scene}: {error}") from None


def srs(arm: Arm, option: str) -> Arm:
    """Return an arm that has an arm angle; the error for another kind names the option."""
    if arm.redundancy != "arm_angle":
        raise InputError(f"{option} does not go with {called(arm)}")
    return arm


def is_description(text: str) -> bool:
    """Return whether a word names a URDF or MJCF instead of a catalogue arm or a TOML file."""
    suffix = Path(text).suffix.lower()
    return suffix in _DESCRIPTIONS or (suffix != ".toml" and Path(text).is_file())


def links_of(args: argparse.Namespace) -> tuple[str | None, str | None]:
    """Return base and tip of --links, None if they are to be guessed."""
    if args.links is None:
        return None, None
    base, comma, tip = args.links.partition(",")
    if not comma or "," in tip:
        raise InputError(f"--links is {args.links!r}, wanted BASE,TIP; one of them may be empty")
    return base or None, tip or None


def body_of_file(file: str, links: tuple[str | None, str | None], **options: Any) -> Body:
    """Return balls and capsules that contain the collision shapes of a URDF or MJCF."""
    read = Body.from_mjcf if is_mjcf(file) else Body.from_urdf
    return read(file, *links, **options)


def _bare_arm(args: argparse.Namespace, *, quiet: bool) -> Arm:
    """Return the arm of --robot, unchanged from file or catalogue."""
    name = args.robot
    if is_description(name):
        return _of_file(name, args, quiet)
    refuse(args, ("links", "fit", "continuous-limits"), f"{name}: it is for a URDF or MJCF file")
    if Path(name).suffix.lower() == ".toml":
        return Arm._from_description(read_robot(name).description)
    return Arm.from_catalogue(name)


def _of_file(file: str, args: argparse.Namespace, quiet: bool) -> Arm:
    """Return the arm of a URDF or MJCF: as --fit says; by default exact if it is, or on its own chain."""
    base, tip = _named_links(file, *links_of(args))
    options: dict[str, Any] = {"base": base, "tip": tip}
    limits = getattr(args, "continuous_limits", None)
    if not is_mjcf(file):
        options["continuous_limits"] = limits or "ignore"
    elif limits is not None:
        raise InputError(f"--continuous-limits does not go with {file}: it is for a URDF")
    if getattr(args, "fit", None) is not None:
        return _read(file, options | _fit(args.fit), quiet)
    arm = _read(file, options, quiet)
    if arm.kind == "srs_chain" and not quiet:
        note(f"armangle: {file} is nearly S-R-S, and its own chain is kept: {arm.deviation}")
    return arm


def _fit(text: str) -> dict[str, Any]:
    """Return the arguments of `Arm.from_urdf` for the text KIND or KIND,MM,DEG of --fit; raise for others."""
    kind, comma, given = text.partition(",")
    if kind not in _FITS:
        raise InputError(f"--fit is {text!r}, wanted one of {', '.join(_FITS)}, also with ,MM,DEG")
    if not comma:
        return {"fit": kind}
    off = numbers("--fit", given, "KIND,MM,DEG", 2)
    length, tilt = off[0] / 1e3, off[1] * DEGREE
    if not (0 <= length <= MAX_LENGTH and 0 <= tilt <= MAX_ANGLE):
        most = f"{1e3 * MAX_LENGTH:g} mm and {MAX_ANGLE / DEGREE:.4g} deg"
        raise InputError(f"--fit is {text!r}, wanted 0 to {most}")
    return {"fit": kind, "length_tolerance": length, "angle_tolerance": tilt}


def _read(file: str, options: dict[str, Any], quiet: bool) -> Arm:
    """Return the arm of a file; warnings of its reader are passed on unless `quiet`."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        arm = (Arm.from_mjcf if is_mjcf(file) else Arm.from_urdf)(file, **options)
    for warning in () if quiet else caught:
        warnings.warn(warning.message, stacklevel=2)
    return arm


def _named_links(file: str, base: str | None, tip: str | None) -> tuple[str | None, str | None]:
    """Return base and tip. Without a tip it stays None if there is one S-R-S arm to guess, else they are
    those of the only arm with an offset; raise with the choices if there are several.
    """
    if tip is not None:
        return base, tip
    found = (MjcfModel if is_mjcf(file) else UrdfModel)(file).candidates(base)
    best = found[0].rank() if found else 0
    if not found or chosen(found, 0) is not None:
        return base, None
    one = chosen(found, best) if best == 1 else None
    if one is None:
        lines = [f"  --links {one.base},{one.tip}  {one.verdict()}{one.other_tips()}" for one in found]
        message = "name base and tip; chains of seven rotating joints:\n" + "\n".join(lines)
        raise ModelError(message, source=file)
    return one.base, one.tip


def _tool(text: str) -> Floats:
    """Return the frame of --tool in the tip frame, (4, 4)."""
    count = len(text.replace(",", " ").split())
    if count not in (3, len(COLUMNS)):
        raise InputError(f"--tool has {count} numbers, wanted x,y,z or {','.join(COLUMNS)}")
    tool = pose("--tool", text if count == len(COLUMNS) else f"{text},1,0,0,0")
    if np.abs(tool[:3, 3]).max() > _LONGEST:
        raise InputError(f"--tool is {text}, a place in m: was this in mm?")
    return tool


def _with_body(arm: Arm, args: argparse.Namespace) -> Arm:
    """Return the arm with the collision model of --body, or of the file of --robot."""
    own = is_description(args.robot)
    text = args.robot if args.body is None and own else args.body
    if text is None:
        raise InputError(
            "--scene needs the shape of the arm's links: --body 90,80 (radii of the bones in mm), or guessed"
        )
    if text == "guessed":
        return arm.with_(body="guessed")
    if Path(text).suffix.lower() == ".toml":
        return arm.with_(body=load_body(text))
    if not Path(text).is_file():
        upper_arm, forearm = _radii("--body", text, "UPPER,FOREARM in mm, or a file", 2)
        return arm.with_(body=Body.bones(upper_arm=upper_arm, forearm=forearm))
    links = links_of(args) if own else (None, None)
    return arm.with_(body=body_of_file(text, links))


def _gripper(args: argparse.Namespace) -> tuple[Shape, ...]:
    """Return the shapes of --gripper in the tool frame: those of a file, or a ball or capsule of a radius."""
    text = args.gripper
    if Path(text).suffix.lower() == ".toml":
        held = load_scene(text)
        if held.clearance or held.soft or held.ignore:
            raise InputError(f"{text}: clearance, soft and ignore are of the scene, not of a gripper")
        return held.shapes
    (radius,) = _radii("--gripper", text, "a RADIUS in mm, or gripper.toml", 1)
    if args.tool is None:
        return (Ball([0.0, 0.0, 0.0], radius),)
    tool = _tool(args.tool)
    return (Capsule(-tool[:3, :3].T @ tool[:3, 3], [0.0, 0.0, 0.0], radius),)


def _radii(option: str, text: str, wanted: str, count: int) -> list[float]:
    """Return radii given in mm, m."""
    radii = numbers(option, text, wanted, count) / 1e3
    if 0 < np.max(radii) < _THINNEST:
        raise InputError(f"{option} is {text}, in mm: was this in m?")
    return [float(radius) for radius in radii]
