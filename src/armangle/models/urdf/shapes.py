"""Poses of a URDF's shapes: the DH frame that carries each visual or collision."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple, NoReturn
from xml.etree import ElementTree

import numpy as np

from ..._arrays import Floats
from ..._opening import NUMBERS, check_file
from ..chain import Chain, rigid_inverse
from .origin import origin
from .tags import numbers_in

_ROTATING = ("revolute", "continuous")


class PlacedElement(NamedTuple):
    """One <visual> or <collision>: its link, the DH frame that carries it, and the link's frame in that."""

    link: str
    frame: int
    place: Floats
    element: Any


def placed_elements(
    text: str | bytes, chain: Chain, rest: Floats, tag: str, left: list[str] | None = None
) -> Iterator[PlacedElement]:
    """Yield the elements of all links that move with the base or with one of the chain's joints alone.

    `text` and `chain` are those of a `UrdfModel`, without entities. `rest` (8, 4, 4) are the DH frames at q =
    0 in the chain's base link. `tag` is "visual" or "collision". `left` receives the names of links with
    joints of their own.
    """
    root = ElementTree.fromstring(text)
    moving = {joint.name: i + 1 for i, joint in enumerate(chain.joints)}
    links = {link.get("name"): link for link in root.findall("link")}
    pending = [(chain.base, 0, np.eye(4))]
    while pending:
        name, frame, placed = pending.pop()
        local = rigid_inverse(rest[frame]) @ placed
        for element in links[name].findall(tag):
            yield PlacedElement(name, frame, local, element)
        for joint in root.findall("joint"):
            parent, child = joint.find("parent"), joint.find("child")
            if parent is None or child is None or parent.get("link") != name:
                continue
            rotates = joint.get("type") in _ROTATING
            after = moving.get(joint.get("name", ""), None if rotates else frame)
            if after is not None and (rotates or joint.get("type") == "fixed"):
                pending.append((child.get("link", ""), after, placed @ origin_of(joint)))
            elif left is not None:
                left.append(child.get("link", ""))


def origin_of(element: Any) -> Floats:
    """Return the pose (4, 4) of an element's <origin>."""
    part = element.find("origin")

    def read(key: str, count: int) -> Floats | None:
        """Return the numbers of an attribute; None if it is missing."""
        text = None if part is None else part.get(key)
        return None if text is None else numbers_of(text, count)

    return origin(read)


def numbers_of(text: str | None, count: int, default: float | None = None) -> Floats:
    """Return the `count` numbers of an attribute's text; `default` for each if there is none.

    Raises `ValueError` if the count differs, they are not finite numbers, or missing without a default.
    """
    if text is None and default is not None:
        return np.full(count, default)
    try:
        return numbers_in(text or "", count)
    except ValueError as error:
        raise ValueError(f"{text!r} {error}") from None


def mesh_file(name: str, folder: Path) -> Path:
    """Return the local file of a mesh name: a path, file://, or package:// searched above the URDF.

    Raises `ValueError` if there is none, it is not local, or it is too large.
    """

    def fail(why: str) -> NoReturn:
        """Raise an error with the mesh's name."""
        raise ValueError(f"{name}: {why}")

    scheme, _, rest = name.rpartition("://")
    if scheme == "file":
        places = [Path(rest)]
    elif scheme == "package":
        package, _, inside = rest.partition("/")
        above = (folder.resolve(), *folder.resolve().parents)
        places = [p / package / inside for p in above] + [p / inside for p in above if p.name == package]
    elif scheme:
        raise ValueError(f"{name}: only local files are read")
    else:
        places = [folder / name]
    for place in places:
        if place.exists():
            check_file(place, NUMBERS, fail)
            return place
    fail("no such file")
