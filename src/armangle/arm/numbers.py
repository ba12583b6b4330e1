"""The numbers of an arm as arguments of `Arm`: their names, types, defaults and checks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import MISSING, Field, fields
from inspect import Parameter, Signature
from typing import Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from .. import _core
from .._arrays import (
    JOINTS,
    Floats,
    as_floats,
    as_number,
    check_angles,
    chosen,
    frozen,
    named,
    one_or_seven,
    warn,
)
from ..errors import InputError, SceneError
from ..models.body import Body
from ..models.description import ELBOW_OFFSETS, FRAMES, JOINT_ROWS, LENGTHS, ArmDescription, ImportReport
from ..models.report import LIKE_DEGREES, LIKE_MILLIMETRES, degrees_notes, millimetre_notes
from ..poses import as_transform
from ..scenes.scene import Scene, as_shapes
from ..scenes.shapes import HOLDABLE, Shape

Reference = ArrayLike | Literal["base", "stereographic"]

BOUNDS = ("velocity", "acceleration")
FIELDS = fields(ArmDescription)
LEAST_LINK = 1e-6  # m: of upper arm and forearm; a shorter one has wrong units
_ONE_FOR_ALL = ("lower", "upper", *BOUNDS)
_OPTIONAL = (*JOINT_ROWS, *FRAMES, "joint_names", "chain")  # None stands for the default
_REFERENCES = {n: v for n, v in named(_core.Reference).items() if v is not _core.Reference.VECTOR}


class ArmArguments(TypedDict, total=False):
    """The fields of `ArmDescription` that `Arm` accepts, typed for editors and type checkers."""

    d_bs: float
    d_se: float
    d_ew: float
    d_wf: float
    a_3: float
    a_4: float
    a_1: float
    a_6: float
    d_4: float
    lower: ArrayLike | None
    upper: ArrayLike | None
    signs: ArrayLike | None
    offsets: ArrayLike | None
    base: ArrayLike | None
    tool: ArrayLike | None
    velocity: ArrayLike | None
    acceleration: ArrayLike | None
    name: str
    joint_names: tuple[str, ...] | None
    reference: Reference
    chain: ArrayLike | None
    body: Body | Literal["guessed"] | None
    hand: Iterable[Shape]
    notes: tuple[str, ...] | str
    report: ImportReport | None
    scene: Scene | None
    singularity_margin: float


def default_of(field: Field[Any]) -> Any:
    """Return the default value of an argument of `Arm`; MISSING if it is required."""
    return field.default_factory() if field.default_factory is not MISSING else field.default


def signature() -> Signature:
    """Return the keywords of `Arm` and their defaults, for help() and the documentation."""
    shown = {f.name: None if f.name in _OPTIONAL else default_of(f) for f in FIELDS}
    shown |= {"a_1": 0.0, "a_6": 0.0, "report": None, "scene": None, "singularity_margin": 0.0}
    return Signature(
        [
            Parameter(n, Parameter.KEYWORD_ONLY, default=Parameter.empty if default is MISSING else default)
            for n, default in shown.items()
        ]
    )


def checked(given: dict[str, Any]) -> dict[str, Any]:
    """Return all arguments of `Arm` by name, checked, arrays read-only; warn of likely degrees or mm."""
    values = _complete(given)
    for name in (*LENGTHS, *ELBOW_OFFSETS):
        low = 0.0 if name in ("d_se", "d_ew") else -_core.LENGTH_LIMIT
        values[name] = as_number(f"{name} (m)", values[name], low, _core.LENGTH_LIMIT)
    _check_link("upper arm", "d_se", "a_3", values)
    _check_link("forearm", "d_ew", "a_4", values)
    for name in JOINT_ROWS:
        values[name] = _seven(name, values[name], infinite=name not in ("signs", "offsets"))
    for name in FRAMES:
        values[name] = as_transform(name, values[name])
    values["reference"] = _checked_reference(values["reference"])
    values["chain"] = checked_chain(values["chain"])
    values["joint_names"] = _checked_names(values["name"], values["joint_names"])
    if isinstance(values["body"], str) and values["body"] == "guessed":
        values["body"] = Body._guessed(values["d_se"], values["d_ew"])
    if not isinstance(values["body"], Body | None):
        raise SceneError(
            "arm", "body", values["body"], "an armangle.Body, as Body({3: [Ball(...)]}), or None"
        )
    values["hand"] = as_shapes("hand", values["hand"], HOLDABLE)
    _check_rows(values)
    notes = (values["notes"],) if isinstance(values["notes"], str) else tuple(values["notes"])
    of_units = {
        LIKE_DEGREES: degrees_notes(values["joint_names"], values["lower"], values["upper"]),
        LIKE_MILLIMETRES: millimetre_notes(
            {name: values[name] for name in (*LENGTHS, *ELBOW_OFFSETS)}
            | {"tool": float(np.linalg.norm(values["tool"][:3, 3]))}
        ),
    }
    for what, found in of_units.items():
        kept = tuple(note for note in notes if not note.startswith(what))
        if found and len(kept) == len(notes):  # a copy of an arm with a warning does not warn again
            warn(found[0])
        notes = (*kept, *found)
    values["notes"] = notes
    values["signs"] = frozen(values["signs"].astype(np.int64))
    return values


def _complete(given: dict[str, Any]) -> dict[str, Any]:
    """Return a value for each field, the default if it is missing, or None and one of `_OPTIONAL`.

    Raises `TypeError` for an unknown or missing keyword, `InputError` for a chain without its nominal arm.
    """
    known = {f.name for f in FIELDS}
    for name in given:
        if name not in known:
            raise TypeError(f"Arm() got an unexpected keyword argument {name!r}")
    missing = [f.name for f in FIELDS if default_of(f) is MISSING and f.name not in given]
    if missing and given.get("chain") is not None:
        raise InputError(
            f"a chain needs the S-R-S arm beside it, which lends psi and gc, and {', '.join(missing)} are "
            "not given: arm.with_(chain=...) of the data sheet's arm, or Arm.from_urdf(file), "
            "which fits one"
        )
    if missing:
        arguments = f"argument{'s' * (len(missing) > 1)}: {', '.join(map(repr, missing))}"
        raise TypeError(f"Arm() missing {len(missing)} required keyword-only {arguments}")
    default = {f.name: default_of(f) for f in FIELDS}
    return default | {n: value for n, value in given.items() if value is not None or n not in _OPTIONAL}


def checked_chain(value: ArrayLike | None) -> Floats | None:
    """Return eight rigid transforms, read-only, or None."""
    if value is None:
        return None
    links = as_floats("chain", value, (JOINTS + 1, 4, 4))
    if links.ndim != 3:
        raise InputError(f"chain has shape {links.shape}, wanted {(JOINTS + 1, 4, 4)}")
    return frozen(np.array([as_transform(f"chain[{k}]", link) for k, link in enumerate(links)]))


def _check_link(what: str, along: str, across: str, values: dict[str, Any]) -> None:
    """Raise if a link, values[along] (m) by values[across], has no length; errors call it `what`."""
    length = math.hypot(values[along], values[across])
    if length < LEAST_LINK:
        raise InputError(
            f"{along} (m) is {values[along]:g} and {across} is {values[across]:g}: "
            f"the {what} is {length:g} m long, wanted at least {LEAST_LINK:g}"
        )


def _seven(name: str, value: ArrayLike, *, infinite: bool) -> Floats:
    """Return seven numbers, of one if it may be for all; raise for NaN and, unless `infinite`, infinities."""
    array = (one_or_seven(name, value) if name in _ONE_FOR_ALL else as_floats(name, value, (JOINTS,))).copy()
    if array.shape != (JOINTS,):
        raise InputError(f"{name} has shape {array.shape}, wanted ({JOINTS},)")
    bad = np.isnan(array) if infinite else ~np.isfinite(array)
    if bad.any():
        at = int(np.argmax(bad))
        wanted = "real" if infinite else "finite"
        raise InputError(f"{name}[{at}] is {array[at]}, wanted a {wanted} number")
    return frozen(array)


def _checked_names(name: str, joint_names: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the joints, seven different ones."""
    if not isinstance(name, str):
        raise InputError(f"name is {name!r}, wanted a string")
    names = tuple(joint_names)
    if len(names) != JOINTS or len({*names}) != JOINTS or not all(isinstance(n, str) for n in names):
        raise InputError(f"joint_names is {joint_names!r}, wanted {JOINTS} different strings")
    return names


def _checked_reference(reference: Reference) -> str | tuple[float, ...]:
    """Return the checked `reference`: a word, or a vector scaled to the largest entry 1; raise for others."""
    if isinstance(reference, str):
        return chosen("reference", reference, _REFERENCES)
    vector = as_floats("reference", reference, (3,))
    if vector.ndim != 1:
        raise InputError(f"reference has shape {vector.shape}, wanted (3,)")
    if not np.isfinite(vector).all():
        raise InputError(f"reference is {vector.tolist()}, wanted finite numbers")
    if not (vector != 0).any():
        raise InputError("reference is zero, wanted a direction")
    return tuple((vector / np.abs(vector).max()).tolist())


def core_reference(reference: str | tuple[float, ...]) -> tuple[_core.Reference, Floats]:
    """Return the core's kind of reference direction and its vector, which only kind VECTOR uses."""
    if isinstance(reference, str):
        return _REFERENCES[reference], np.array([0.0, 0.0, 1.0])
    return _core.Reference.VECTOR, np.array(reference)


def _check_rows(values: dict[str, Any]) -> None:
    """Raise if the seven signs, limits or bounds contradict each other."""
    sign = values["signs"]
    if not np.all(np.abs(sign) == 1):
        at = int(np.argmax(np.abs(sign) != 1))
        raise InputError(f"signs[{at}] is {sign[at]:g}, wanted +1 or -1")
    for name in ("lower", "upper", "offsets"):
        check_angles(name, np.where(np.isinf(values[name]), 0.0, values[name]))
    lower, upper = values["lower"], values["upper"]
    crossed = ~(lower <= upper) | (lower == np.inf) | (upper == -np.inf)
    if crossed.any():
        at = int(np.argmax(crossed))
        raise InputError(
            f"lower[{at}] is {lower[at]:g} and upper[{at}] is {upper[at]:g}, wanted lower <= upper"
        )
    for name in BOUNDS:
        if not (values[name] > 0).all():
            at = int(np.argmax(~(values[name] > 0)))
            raise InputError(f"{name}[{at}] is {values[name][at]:g}, wanted a positive number")
