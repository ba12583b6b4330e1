"""Reports about an arm from a file: its accuracy, and numbers that are probably wrong."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from .._arrays import warn
from .axes import POSTURES, Axes
from .chain import Chain
from .description import ImportReport

NOT_EXACT = "not quite the arm of its file:"
NOT_USED = "NOT used"
CONTINUOUS = "is continuous, which means no limits"
NO_RANGE = "limits leave no range"
ALL_WITHOUT = "all limits are 0 to 0"
LIKE_RADIANS = "limits look like rad where degrees are read"
LIKE_DEGREES = "limits look like degrees where rad are wanted"
LIKE_MILLIMETRES = "lengths look like mm where m are wanted"
_SUSPICIOUS_VELOCITY = 10.0  # rad/s
LONGEST_LINK = 10.0  # m: longer than the link of any arm of this kind
_SMALL_LIMIT = math.radians(2.0 * math.pi)  # rad: a full turn in rad, read as degrees
_SUSPICIOUS_LIMIT = 20.0  # rad: no joint turns three times, but many files have degrees


def import_report(chain: Chain, residual: tuple[float, float], notes: tuple[str, ...]) -> ImportReport:
    """Return how far a chain is off its arm; `residual` is the largest deviation of the tip (m, rad)."""
    axes = Axes(*chain.lines())
    shoulder, wrist = axes.worst_miss
    position, rotation = residual
    return ImportReport(
        source=chain.source,
        base=chain.base,
        tip=chain.tip,
        joint_names=tuple(joint.name for joint in chain.joints),
        shoulder_miss=shoulder,
        wrist_miss=wrist,
        angle_miss=axes.worst_squareness,
        residual_position=position,
        residual_rotation=rotation,
        postures=POSTURES,
        notes=notes,
    )


def warn_of(notes: Iterable[str]) -> None:
    """Warn of important notes: an arm that differs from its file, limits that are probably wrong, and limits
    that are given but not used.
    """
    for note in notes:
        meant = CONTINUOUS in note and NOT_USED in note
        if meant or note.startswith((NOT_EXACT, NO_RANGE, ALL_WITHOUT, LIKE_DEGREES, LIKE_RADIANS)):
            warn(note)


def import_notes(chain: Chain) -> tuple[str, ...]:
    """Return the reader's notes, and notes on limits and velocities that look wrong."""
    return (*chain.notes, *_limit_notes(chain), *_velocity_notes(chain))


def _limit_notes(chain: Chain) -> tuple[str, ...]:
    """Return notes on limits that are an exporter's default, leave no range, or look like another unit's."""
    still = [joint.name for joint in chain.joints if joint.lower == joint.upper]
    if len(still) == len(chain.joints) and not any(joint.upper for joint in chain.joints):
        return (f"{ALL_WITHOUT}, so that no joint may move: state the true ones",)
    notes = []
    if still:
        notes.append(f"{NO_RANGE} to joint {', '.join(map(repr, still))}: state the true ones")
    lower, upper = [joint.lower for joint in chain.joints], [joint.upper for joint in chain.joints]
    most = max((abs(end) for end in (*lower, *upper) if math.isfinite(end)), default=0.0)
    if 0.0 < most <= _SMALL_LIMIT:
        missing = 'in an MJCF, is <compiler angle="radian"/> missing?'
        notes.append(f"{LIKE_RADIANS}: none is beyond {math.degrees(most):.3g} deg; {missing}")
    return (*notes, *degrees_notes([joint.name for joint in chain.joints], lower, upper))


def degrees_notes(names: Iterable[str], lower: Iterable[float], upper: Iterable[float]) -> tuple[str, ...]:
    """Return a note if limits (rad) are so wide that they look like degrees, otherwise nothing."""
    wide = [
        f"{name!r} {low:g} to {high:g}"
        for name, low, high in zip(names, lower, upper, strict=True)
        if any(_SUSPICIOUS_LIMIT < abs(end) < math.inf for end in (low, high))
    ]
    return (f"{LIKE_DEGREES}: joint {', '.join(wide)}",) if wide else ()


def millimetre_notes(lengths: Mapping[str, float]) -> tuple[str, ...]:
    """Return a note if lengths (m) are so long that they look like mm, otherwise nothing."""
    long = [f"{name} {value:g}" for name, value in lengths.items() if abs(value) > LONGEST_LINK]
    return (f"{LIKE_MILLIMETRES}: {', '.join(long)}",) if long else ()


def _velocity_notes(chain: Chain) -> tuple[str, ...]:
    """Return a note for each velocity so large (10 rad/s or more) that it looks like a template's."""
    return tuple(
        f"velocity of joint {joint.name!r} is {joint.velocity:.4g} rad/s "
        f"({math.degrees(joint.velocity):.4g} deg/s): not trusted"
        for joint in chain.joints
        if _SUSPICIOUS_VELOCITY <= joint.velocity < math.inf
    )
