"""The arm with an offset wrist or shoulder that equals a chain of joints, or why there is none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from .._arrays import millimetres
from ..errors import ModelError
from .axes import NEAR_LENGTH, Axes, differs
from .chain import Chain, links_of
from .description import ArmDescription, ImportReport, OffsetDescription
from .detect import nearness, srs_arm
from .offset import (
    ANGLE_TOLERANCE,
    LENGTH_TOLERANCE,
    _kind,
    _off,
    _read,
    _with_one_offset,
    _within,
)
from .report import NOT_EXACT, import_notes, import_report


def describe_offset_chain(
    chain: Chain, *, angle: float = ANGLE_TOLERANCE, length: float = LENGTH_TOLERANCE
) -> tuple[OffsetDescription, ImportReport]:
    """Return the numbers of a chain whose axes are those of an S-R-S arm except for a_1 or a_6.

    The Denavit-Hartenberg rows are computed from neighbouring axes, and accepted if their forward kinematics
    is that of the chain within `length` (m) and `angle` (rad). A least-squares fit to a calibrated chain
    would improve its positions by some hundredths. Raises `ModelError` if the chain is no such arm.
    """
    if len(chain.joints) != 7:
        raise ModelError(f"{chain.source}: the chain has {len(chain.joints)} rotating joints, wanted 7")
    whole = _read(chain)
    found = _with_one_offset(whole)
    off_whole, off = _off(chain, whole), _off(chain, found)
    small = max(abs(whole.a_1), abs(whole.a_6)) <= length
    if small and _within(off_whole, length, angle):
        raise ModelError(
            f"{chain.source}: no offset at wrist or shoulder beyond length_tolerance, {millimetres(length)}"
        )
    if min(abs(whole.a_1), abs(whole.a_6)) > length and _within(off_whole, length, angle):
        raise ModelError(
            f"{chain.source}: offsets at both ends, {millimetres(abs(whole.a_1))} between axes 1 and 2 and "
            f"{millimetres(abs(whole.a_6))} between axes 6 and 7: there is no closed form for both"
        )
    if not _within(off, length, angle):
        raise ModelError(
            f"{chain.source}: not an arm with one offset wrist or shoulder: its rows miss "
            f"its forward kinematics by up to {differs(off)}"
        )
    notes = import_notes(chain)
    if not _within(off, LENGTH_TOLERANCE, ANGLE_TOLERANCE):
        kind = f"{NOT_EXACT} S-R-S but for {_kind(found)}"
        notes = (*notes, f"{kind}, it differs by up to {differs(off)} at the tip")
    found = replace(found, notes=notes)
    return found, import_report(chain, off, notes)


def describe_near_offset(chain: Chain) -> tuple[OffsetDescription, ImportReport]:
    """Return the arm with one offset whose axes are near those of a chain, with the chain in it, and a
    report; raise `ModelError` unless that offset is larger than `NEAR_LENGTH`.
    """
    if len(chain.joints) != 7:
        raise ModelError(f"{chain.source}: the chain has {len(chain.joints)} rotating joints, wanted 7")
    found = _with_one_offset(_read(chain))
    off = _off(chain, found)
    if max(abs(found.a_1), abs(found.a_6)) <= NEAR_LENGTH:
        raise ModelError(
            f"{chain.source}: no offset at wrist or shoulder larger than {millimetres(NEAR_LENGTH)}"
        )
    notes = (
        *import_notes(chain),
        f"only nearly S-R-S but for {_kind(found)}: the chain of the file is kept, and psi and gc are those "
        f"of that arm, which differs by up to {differs(off)} at the tip; arm.deviation.proven_share says "
        "how often feasible intervals are proven completely",
    )
    found = replace(found, notes=notes, chain=links_of(chain))
    return found, import_report(chain, (0.0, 0.0), notes)


def own_arm(read: Callable[[bool], Chain]) -> tuple[Chain, ArmDescription]:
    """Return the chain of a file and its arm, of the kind that fits, for a `Body`.

    `read` takes whether the guess of base and tip is for an arm with an offset wrist or shoulder.
    """
    try:
        chain = read(False)
    except ModelError:  # there may be an arm with an offset in it
        found = _with_offset(read, 0.0)
        if found is None:
            raise
        return found
    if not nearness(Axes(*chain.lines())).srs and (found := _with_offset(read, NEAR_LENGTH)):
        return found
    return chain, srs_arm(chain)


def _with_offset(read: Callable[[bool], Chain], least: float) -> tuple[Chain, ArmDescription] | None:
    """Return chain and arm if it has an offset wrist or shoulder of more than `least`, m; else None."""
    try:
        chain = read(True)
        found, _ = describe_offset_chain(chain)
    except ModelError:
        return None
    return (chain, found) if max(abs(found.a_1), abs(found.a_6)) > least else None
