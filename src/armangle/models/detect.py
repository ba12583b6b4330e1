"""S-R-S arms from seven axes: lengths, signs, zeros and frames, or the reasons why not.

Only the axes as lines at q = 0 matter, with the base and tip frames; the file's own link frames do not. The
same arm has several representations. The one chosen here:

- ``d_bs, d_se, d_ew, d_wf >= 0``, which fixes the senses of axes 1, 3, 5 and 7;
- ``d_bs`` is the height of the shoulder over the base origin, ``d_wf`` the reach of the tip origin
  over the wrist, both along their axes; offsets across the axes go into ``base`` and ``tool``;
- zeros of joints 1 and 7 are nil: a turn about those axes goes into ``base`` and ``tool`` too;
- of the senses still free, those with the fewest and smallest zeros, then the least turn in
  ``base``, then the fewest minus signs.

Elbow offsets are ``a_3`` and ``a_4``, across axis 4, and ``d_4``, a gap along it. Shoulder or wrist axes in
another order (roll, pitch, yaw) are zeros of joints 2 and 6.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from .. import _core
from .._arrays import JOINTS, millimetres
from ..errors import InputError, ModelError
from .axes import (
    MAX_ANGLE,
    MAX_LENGTH,
    NEAR_ANGLE,
    NEAR_LENGTH,
    ROUNDING,
    SRS_ANGLE,
    SRS_LENGTH,
    Axes,
    above,
    angle_about,
    cross,
    differs,
    exceeds,
    reasons_against,
    rotation_angle,
    rounded,
    tolerances,
    worst_difference,
)
from .chain import Chain, FloatArray, chain_of, links_of, rigid_inverse
from .description import ELBOW_OFFSETS, LENGTHS, ArmDescription, ImportReport
from .fit import fit
from .offset import offset_hint
from .report import NOT_EXACT, import_notes, import_report

ANGLE_TOLERANCE = SRS_ANGLE
LENGTH_TOLERANCE = SRS_LENGTH
ZERO_LENGTH = 2e-5

_NOISE = 1e-12


_ENDS = (0, 6)  # joints whose length may be in base or tool as well


class _Slack(NamedTuple):
    """Tolerances of a representation: the length (m) between two axes, zeros of joints and rotations (rad),
    and the difference of two representations.
    """

    length: float
    zero: float
    tie: float


_EXACT = _Slack(ZERO_LENGTH, ANGLE_TOLERANCE, 1e-6)
_CALIBRATED = _Slack(2e-3, NEAR_ANGLE, NEAR_ANGLE)
"""For an arm fitted to a chain: errors of a calibration must not choose the senses of axes."""


def describe_chain(
    chain: Chain,
    *,
    angle: float = ANGLE_TOLERANCE,
    length: float = LENGTH_TOLERANCE,
    exact: bool = True,
    of_body: bool = False,
) -> tuple[ArmDescription, ImportReport]:
    """Return the S-R-S arm that equals a chain of seven rotating joints, exactly or nearly, and a report.

    The arm is in the joint coordinates and frames of the chain: the chain itself without its rounding errors,
    or, beyond the default tolerances, the arm fitted to it. The report has the deviation of the chain itself
    from that. Raises `ModelError` with all the reasons if there is no such arm.

    `angle` (rad) is the permitted deviation of neighbouring axes from right angles, `length` (m) that of axes
    from the shoulder and wrist points. Elbow offsets and lengths are always kept unless they are below
    `ZERO_LENGTH`. If not `exact`, the chain is kept with the arm if the two differ; axes may then deviate by
    `NEAR_ANGLE` and `NEAR_LENGTH`, or by larger tolerances. `of_body`: for the links of a `Body`, which has
    no tolerances, so the error names none.
    """
    _check_tolerances(angle, length)
    axes = Axes(*chain.lines())
    most = (angle, length) if exact else (max(angle, NEAR_ANGLE), max(length, NEAR_LENGTH))
    if reasons := reasons_against(axes, *most):
        raise _refusal(chain, nearness(axes), [reason.sentence for reason in reasons], angle, length, of_body)
    snaps = not reasons_against(axes, ANGLE_TOLERANCE, LENGTH_TOLERANCE)
    arm = _snapped(chain) if snaps else fitted_arm(chain)
    notes = import_notes(chain)
    off = residual(chain, arm)
    if exact and not snaps:
        notes = (
            *notes,
            f"{NOT_EXACT} the S-R-S arm fitted to it differs by up to {differs(off)} at the tip",
        )
    if not exact and max(off) > ROUNDING:
        arm = replace(arm, chain=links_of(chain))
        notes = (
            *notes,
            "only nearly S-R-S: the chain of the file is kept, and psi and gc are those of the S-R-S arm "
            f"fitted to it, which differs by up to {differs(off)} at the tip",
        )
    arm = replace(arm, notes=notes)
    return arm, import_report(chain, off, arm.notes)


def srs_arm(chain: Chain) -> ArmDescription:
    """Return the S-R-S arm of a chain for a `Body`: with the chain itself if it is only nearly S-R-S."""
    try:
        return describe_chain(chain, of_body=True)[0]
    except ModelError:
        return describe_chain(chain, exact=False, of_body=True)[0]


@dataclass(frozen=True)
class Nearness:
    """Deviation of seven axes from those of an S-R-S arm.

    `miss`, largest distance of axes from the shoulder or wrist point, m; `tilt`, largest deviation of two
    neighbours from a right angle, rad; `srs`, whether they are S-R-S within the default tolerances; `near`,
    whether they are not, but are up to `NEAR_LENGTH` and `NEAR_ANGLE`.
    """

    miss: float
    tilt: float
    srs: bool
    near: bool


def nearness(axes: Axes) -> Nearness:
    """Return the deviation of seven axes from those of an S-R-S arm."""
    miss, tilt = max(axes.worst_miss), axes.worst_squareness
    srs = not reasons_against(axes, ANGLE_TOLERANCE, LENGTH_TOLERANCE)
    near = not srs and not reasons_against(axes, NEAR_ANGLE, NEAR_LENGTH)
    return Nearness(miss, tilt, srs, near)


def fitted_arm(chain: Chain) -> ArmDescription:
    """Return the S-R-S arm fitted to a chain, in its joint coordinates, limits and frames."""
    fitted = replace(chain_of(fit(_snapped(chain), chain)), name=chain.name)
    return _snapped(fitted, _CALIBRATED)


def residual(chain: Chain, arm: ArmDescription) -> tuple[float, float]:
    """Return the largest distance (m) and angle (rad) found between the tips of a chain and an arm."""
    return worst_difference(chain_of(arm), chain)


def _snapped(chain: Chain, slack: _Slack = _EXACT) -> ArmDescription:
    """Return the S-R-S arm nearest to a chain at q = 0: axes made perpendicular and intersecting."""
    axes = Axes(*chain.lines())
    return _with_tool(chain, axes, _plainest([*_writings(chain, axes, slack)], slack))


def _check_tolerances(angle: float, length: float) -> None:
    """Raise :class:`InputError` unless both tolerances are valid."""
    for name, value, most in (("angle", angle, MAX_ANGLE), ("length", length, MAX_LENGTH)):
        if not 0.0 <= value <= most:
            raise InputError(f"tolerance {name} is {value}, wanted 0 to {most}")


def _refusal(
    chain: Chain, found: Nearness, reasons: list[str], angle: float, length: float, of_body: bool
) -> ModelError:
    """Return the error of a chain outside the tolerances: the reasons, then arguments that accept it."""
    what = f"{chain.name!r} ({chain.base} to {chain.tip}) is not S-R-S"
    if found.near:
        what += f", but near it: nothing is off by more than {_misses(found, angle, length)}"
    own = 'fit="own" takes it as it is, with the chain of the file' if found.near else ""
    doors = [own, offset_hint(chain), _fitted_sentence(chain, found, angle, length)]
    doors = [] if of_body else [door for door in doors if door]
    said = [f"{what}: {'; '.join(reasons)}.", *(door.removesuffix(".") + "." for door in doors)]
    return ModelError("\n".join(said), tuple(reasons), found.near)


def _within_most(chain: Chain, found: Nearness) -> bool:
    """Return whether a chain is not S-R-S, the largest tolerances accept it, and the core keeps it with its
    fitted arm.
    """
    axes = Axes(*chain.lines())
    if found.srs or reasons_against(axes, MAX_ANGLE, MAX_LENGTH):
        return False
    misses = (found.miss, MAX_LENGTH), (found.tilt, MAX_ANGLE)
    if any(value and exceeds(float(above(value)), most) for value, most in misses):
        return False
    off = chain_core(replace(fitted_arm(chain), chain=links_of(chain))).deviations
    return all(length <= MAX_LENGTH and angle <= MAX_ANGLE for length, angle in off)


def chain_core(arm: ArmDescription) -> _core.ChainArm:
    """Return the core's arm of a description with its own chain."""
    lengths = np.array([getattr(arm, name) for name in (*LENGTHS, *ELBOW_OFFSETS)])
    joints = np.concatenate([arm.signs, arm.offsets, arm.lower, arm.upper]).astype(np.float64)
    base = _core.Reference.BASE, np.array([0.0, 0.0, 1.0])  # the arm angle is not used
    assert arm.chain is not None
    return _core.ChainArm(lengths, joints, arm.base, arm.tool, *base, arm.chain)


def _misses(found: Nearness, angle: float, length: float) -> str:
    """Return as text the deviations of the axes that exceed the tolerances (rad, m)."""
    off = [f"{millimetres(found.miss)}"] if exceeds(found.miss, length) else []
    off += [f"{np.degrees(found.tilt):.4g} deg"] if exceeds(found.tilt, angle) else []
    return " and ".join(off)


def _fitted_sentence(chain: Chain, found: Nearness, angle: float, length: float) -> str:
    """Return in words the tolerances with which the fitted S-R-S arm is accepted, and its deviation; "" if
    none are.
    """
    if not found.near and not _within_most(chain, found):
        return ""
    wanted = tolerances(
        found.miss if exceeds(found.miss, length) else None,
        found.tilt if exceeds(found.tilt, angle) else None,
    )
    off = differs(residual(chain, fitted_arm(chain)))
    return (
        f'fit="srs" with {wanted} takes the S-R-S arm fitted to it, which differs from it by up to {off} at '
        "the tip."
    )


def _writings(chain: Chain, axes: Axes, slack: _Slack) -> Iterator[ArmDescription]:
    """Yield the S-R-S arm of the axes, without tool, for each choice of axis signs with lengths ≥ 0."""
    shoulder, wrist = axes.centre("shoulder"), axes.centre("wrist")
    upper, fore = axes.elbow_ends()
    spans = {0: shoulder, 2: upper - shoulder, 3: fore - upper, 4: wrist - fore, 6: _tip(chain) - wrist}
    choices: list[tuple[int, ...]] = [(1, -1)] * JOINTS
    for joint in (0, 2, 4, 6):
        span = spans[joint]
        along = float(span @ axes.directions[joint])
        if abs(along) > (slack.length if joint in _ENDS else ZERO_LENGTH):
            choices[joint] = (1,) if along > 0.0 else (-1,)
    for signs in product(*choices):
        yield _write(chain, axes, signs, spans, slack)


def _tip(chain: Chain) -> FloatArray:
    """Return the origin (3,) of the tip at q = 0, m."""
    return np.asarray(chain.forward(np.zeros(JOINTS))[:3, 3], dtype=np.float64)


def _write(
    chain: Chain,
    axes: Axes,
    signs: tuple[int, ...],
    spans: dict[int, FloatArray],
    slack: _Slack,
) -> ArmDescription:
    """Return the S-R-S arm without tool for one choice of axis signs; `spans` are links (3,), m, by joint.

    The z axes of the DH frames at q = 0 are the signed axes. Each x axis is the common normal of two of them,
    on the side given by the twists (-, +, +, -, -, +) of the paper's Table 1.
    """
    z = _orthogonal_neighbours(axes.directions * np.array(signs)[:, None])
    twists = (-1, 1, 1, -1, -1, 1)
    x = [t * cross(z[i], z[i + 1]) for i, t in enumerate(twists)]
    turns = [angle_about(z[i], x[i - 1], x[i]) for i in range(1, 6)]

    def size(joint: int, direction: FloatArray) -> float:
        """Return the component (m, signed, rounded) of link vector `joint` along a unit vector; 0 if tiny."""
        along = float(spans[joint] @ direction)
        least = slack.length if joint in _ENDS else ZERO_LENGTH
        return 0.0 if abs(along) <= least else rounded(along)

    d_bs = size(0, z[0])
    base = np.eye(4)
    base[:3, :3] = np.column_stack([x[0], z[1], z[0]])
    base[:3, 3] = spans[0] - d_bs * z[0]
    return ArmDescription(
        name=chain.name,
        d_bs=d_bs,
        d_se=size(2, z[2]),
        d_ew=size(4, z[4]),
        d_wf=size(6, z[6]),
        a_3=size(2, x[2]),
        a_4=size(4, x[3]),
        d_4=size(3, z[3]),
        signs=signs,
        offsets=(0.0, *turns, 0.0),
        base=_tidy(base, axes),
    )


def _with_tool(chain: Chain, axes: Axes, arm: ArmDescription) -> ArmDescription:
    """Return the arm with the tool that gives the tip at q = 0, and the chain's own limits."""
    zero = np.zeros(JOINTS)
    tool = rigid_inverse(chain_of(arm).forward(zero)) @ chain.forward(zero)
    return replace(
        arm,
        tool=_tidy(tool, axes),
        lower=tuple(joint.lower for joint in chain.joints),
        upper=tuple(joint.upper for joint in chain.joints),
        velocity=tuple(joint.velocity for joint in chain.joints),
        joint_names=tuple(joint.name for joint in chain.joints),
        notes=chain.notes,
    )


def _orthogonal_neighbours(directions: FloatArray) -> FloatArray:
    """Return seven unit vectors (7, 3), each made orthogonal to the one before it.

    Axis 1 is made orthogonal to axis 2, which is unchanged.
    """
    z = directions.copy()
    for i, fixed in ((0, 1), (2, 1), (3, 2), (4, 3), (5, 4), (6, 5)):
        z[i] -= (z[i] @ z[fixed]) * z[fixed]
        z[i] /= np.linalg.norm(z[i])
    return z


def _tidy(frame: FloatArray, axes: Axes) -> FloatArray:
    """Return the frame (4, 4) with 0 for coordinates (m) that differ from it by rounding only, and a
    rotation of 0, 1 and -1 if all of its entries do.

    If axes are S-R-S only within a tolerance, differences within the default tolerances count as rounding
    too.
    """
    exact = max(*axes.worst_miss, axes.worst_squareness) <= ROUNDING
    turn, shift = (_NOISE, _NOISE) if exact else (ANGLE_TOLERANCE, LENGTH_TOLERANCE)
    tidy = frame + 0.0
    tidy[:3, 3] = np.where(np.abs(frame[:3, 3]) <= shift, 0.0, frame[:3, 3])
    whole = np.round(frame[:3, :3])
    if np.abs(frame[:3, :3] - whole).max() <= turn:
        tidy[:3, :3] = whole + 0.0
    return tidy


def _plainest(writings: list[ArmDescription], slack: _Slack) -> ArmDescription:
    """Return the arm with the fewest joint offsets, then the smallest, then the least rotated base, then the
    fewest mirrored axes; each as far as the tolerance tells.
    """
    measures: tuple[tuple[Callable[[ArmDescription], float], float], ...] = (
        (lambda arm: sum(abs(offset) > slack.zero for offset in arm.offsets), 0.0),
        (lambda arm: sum(abs(offset) for offset in arm.offsets), slack.tie),
        (lambda arm: float(rotation_angle(arm.base - np.eye(4))), slack.tie),
    )
    for measure, tie in measures:
        costs = [measure(arm) for arm in writings]
        writings = [arm for arm, cost in zip(writings, costs, strict=True) if cost <= min(costs) + tie]

    def mirrored(arm: ArmDescription) -> tuple[int, tuple[int, ...]]:
        """Return the sort key of an arm: how many axes are mirrored, and which."""
        minus = tuple(int(sign < 0) for sign in arm.signs)
        return sum(minus), minus

    return min(writings, key=mirrored)
