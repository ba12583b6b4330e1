"""Arms of the catalogue as a calibration would find them: links off at random."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
from numpy.typing import NDArray

import armangle as aa
from armangle.models.chain import chain_of, links_of
from armangle.models.description import OffsetDescription
from support.chain import turn
from support.draw import generator
from support.strategies import bends

Array = NDArray[np.float64]
NAMES = ("kuka_iiwa7_r800", "openarm_v10", "barrett_wam7", "yaskawa_sia5d", "iit_icub_left")
CALIBRATIONS = ((0.1, 0.1), (1.0, 1.0), (2.0, 5.0))  # mm, mrad
Z = np.array([0.0, 0.0, 1.0])


def off(links: Array, mm: float, mrad: float, rng: np.random.Generator) -> Array:
    """Links (8, 4, 4) moved by random translations and rotations of root mean square `mm` and `mrad`."""
    shifts, turns = (size * 1e-3 / 3**0.5 * rng.normal(size=(8, 3)) for size in (mm, mrad))
    return np.array([link @ aa.pose(s, rotvec=t) for link, s, t in zip(links, shifts, turns, strict=True)])


def description(arm: aa.Arm) -> OffsetDescription:
    """The description of an arm of any family, as read from a file."""
    return OffsetDescription(**{f.name: arm._number(f.name) for f in fields(OffsetDescription)})


def own_links(arm: aa.Arm) -> Array:
    """The links (8, 4, 4) of an arm: those of its chain, or of its lengths, zeros and signs."""
    chain = arm.geometry.chain
    return links_of(chain_of(description(arm))) if chain is None else np.asarray(chain)


def calibrated(name: str, mm: float, mrad: float, seed: int = 0) -> aa.Arm:
    """An arm of the catalogue on its own chain, whose links are off at random by `mm` and `mrad` (RMS)."""
    arm = aa.Arm.from_catalogue(name)
    return arm.with_(chain=off(own_links(arm), mm, mrad, generator(seed, round(10 * mm), len(name))))


def plain_forward(arm: aa.Arm, q: Array) -> Array:
    """The tip pose of an arm at joints (7,), its own links multiplied one by one."""
    pose, *links = own_links(arm)
    for angle, link in zip(q, links, strict=True):
        pose = pose @ turn(Z, angle) @ link
    return pose


def postures(arm: aa.Arm, n: int, *seed: int) -> Array:
    """Random joint values (n, 7) within the limits, which must be finite."""
    return generator(*seed).uniform(arm.lower, arm.upper, (n, 7))


def off_singular(arm: aa.Arm, q: Array, least: float) -> Array:
    """Whether theta_2, theta_4 - delta and theta_6 are all at least `least` (rad) from singular values."""
    return np.asarray((np.abs(np.sin(bends(arm, q))) > np.sin(least)).all(axis=1))


ARMS = {f"{name} {mm} mm": calibrated(name, mm, mrad) for name in NAMES for mm, mrad in CALIBRATIONS}
