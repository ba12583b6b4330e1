"""Feasible arcs of the arm angle and redundancy resolution, in place of Eqs. (25), (32)-(36).

An arc (lower, upper) has lower in [-pi, pi) and upper in [lower, lower + 2 pi]; a set of arcs
is a sorted list of disjoint ones, the full circle the single arc (-pi, pi). There are two ways
to the same sets: ``feasible`` in closed form and ``feasible_by_sampling`` by trying.
"""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reference.mended import (
    Circle,
    NoSolutionError,
    circle,
    model_solution,
)
from reference.mended_arm import (
    ANGLE_TOLERANCE,
    Arm,
    Array,
    wrap,
)
from reference.mended_joints import (
    HINGES,
    hinge_function,
    joint_sign,
    pivot_functions,
    roots,
)

Arcs = list[tuple[float, float]]
Status = Literal["OK", "UNREACHABLE", "ELBOW_LIMIT", "ELBOW_MARGIN", "LIMITS"]

TURN = 2 * np.pi
FULL: Arcs = [(-np.pi, np.pi)]
INNER = 0.382
"""Where a piece is tested: off the middle, which symmetry can make a tangent point."""


def contains(arcs: Arcs, psi: float) -> bool:
    """Whether an arm angle (rad, any winding) lies in a set of arcs."""
    return any((psi - low + ANGLE_TOLERANCE) % TURN <= high - low + 2 * ANGLE_TOLERANCE for low, high in arcs)


def measure(arcs: Arcs) -> float:
    """Total length of a set of arcs, rad."""
    return sum(high - low for low, high in arcs)


def arcs_from_test(points: list[float], allowed: Callable[[float], bool]) -> Arcs:
    """Set of arcs cut at break points (rad, any winding) and decided by one inner test each."""
    cuts: list[float] = []
    for point in sorted(float(np.mod(x + np.pi, TURN) - np.pi) for x in points):
        if not cuts or point - cuts[-1] > ANGLE_TOLERANCE:
            cuts.append(point)
    if len(cuts) > 1 and cuts[0] + TURN - cuts[-1] <= ANGLE_TOLERANCE:
        cuts.pop()
    if not cuts:
        return list(FULL) if allowed(INNER) else []
    pieces = list(zip(cuts, [*cuts[1:], cuts[0] + TURN], strict=True))
    verdicts = [allowed(low + INNER * (high - low)) for low, high in pieces]
    if all(verdicts):
        return list(FULL)
    first = verdicts.index(False)
    arcs: Arcs = []
    for step in range(1, len(pieces)):
        k = (first + step) % len(pieces)
        low, high = pieces[k]
        if verdicts[k] and verdicts[k - 1]:
            arcs[-1] = (arcs[-1][0], arcs[-1][1] + high - low)
        elif verdicts[k]:
            arcs.append((low, high))
    return sorted(arcs)


def intersect(sets: list[Arcs]) -> Arcs:
    """Intersection of sets of arcs on the circle, Eq. (25)."""
    ends = [end for arcs in sets if arcs != FULL for arc in arcs for end in arc]
    return arcs_from_test(ends, lambda psi: all(contains(arcs, psi) for arcs in sets))


def angle_allowed(theta: float, lower: float, upper: float) -> bool:
    """Whether some winding of theta lies within [lower, upper], all rad."""
    if upper - lower >= TURN:
        return True
    return bool((theta - lower + ANGLE_TOLERANCE) % TURN <= upper - lower + 2 * ANGLE_TOLERANCE)


def pivot_arcs(ring: Circle, joint: int, lower: float, upper: float) -> Arcs:
    """Arcs on which a pivot joint keeps its limits on theta (rad), in place of Eq. (32)."""
    if upper - lower >= TURN:
        return list(FULL)
    u, v = pivot_functions(ring, joint)
    points = roots(u * np.cos(lower) - v * np.sin(lower))
    points += roots(u * np.cos(upper) - v * np.sin(upper))

    def allowed(psi: float) -> bool:
        """Whether the joint keeps its limits at psi."""
        terms = np.array([np.sin(psi), np.cos(psi), 1.0])
        return angle_allowed(float(np.arctan2(u @ terms, v @ terms)), lower, upper)

    return arcs_from_test(points, allowed)


def hinge_pieces(sign: int, lower: float, upper: float, margin: float) -> Arcs:
    """Parts of the half turn [0, pi] or [-pi, 0] of a hinge within limits and margin, rad."""
    low_half, high_half = sorted((sign * margin, sign * (np.pi - margin)))
    if upper - lower >= TURN:
        return [(low_half, high_half)]
    first, last = (int(np.floor(x / TURN)) for x in (lower, upper))
    pieces = []
    for k in range(first - 1, last + 2):
        low, high = max(low_half, lower - TURN * k), min(high_half, upper - TURN * k)
        if low <= high:
            pieces.append((low, high))
    return pieces


def hinge_arcs(ring: Circle, joint: int, lower: float, upper: float, margin: float) -> Arcs:
    """Arcs on which a hinge joint keeps its limits on theta and a margin from 0 and pi (rad)."""
    sign, h = joint_sign(ring, joint), hinge_function(ring, joint)
    pieces = hinge_pieces(sign, lower, upper, margin)
    ends = [end for piece in pieces for end in piece]
    points = [root for end in ends if 0 < abs(end) < np.pi for root in roots(h - [0, 0, np.cos(end)])]

    def allowed(psi: float) -> bool:
        """Whether the joint keeps its limits and margin at psi."""
        theta = model_solution(ring, psi)[joint - 1]
        slack = ANGLE_TOLERANCE
        return any(low - slack <= theta <= high + slack for low, high in pieces)

    return arcs_from_test(points, allowed)


def joint_arcs(arm: Arm, pose: Array, gc: int, margin: float = 0.0) -> list[Arcs]:
    """Feasible arcs Psi_i of each of the seven joints at a tool pose; joint 4 has all or none."""
    ring = circle(arm, pose, gc)
    sets = []
    for joint, (low, high) in enumerate(zip(*arm.model_limits, strict=True), start=1):
        lower, upper = float(low), float(high)
        if joint == 4:
            sets.append(list(FULL) if angle_allowed(ring.theta_4, lower, upper) else [])
        elif joint in HINGES:
            sets.append(hinge_arcs(ring, joint, lower, upper, margin))
        else:
            sets.append(pivot_arcs(ring, joint, lower, upper))
    return sets


def elbow_status(arm: Arm, ring: Circle, margin: float) -> Status:
    """Whether joint 4, which no arm angle moves, keeps its limits and its margin (rad)."""
    lower, upper = (float(end[3]) for end in arm.model_limits)
    if not angle_allowed(ring.theta_4, lower, upper):
        return "ELBOW_LIMIT"
    bend = abs(np.sin(ring.theta_4 - arm.straight_angle))
    return "ELBOW_MARGIN" if bend < np.sin(margin) else "OK"


def feasible(arm: Arm, pose: Array, gc: int, margin: float = 0.0) -> tuple[Status, Arcs]:
    """Feasible arcs Psi_all of a tool pose and gc in closed form, Eq. (25), with the reason.

    ``margin`` (rad) keeps |sin theta_2|, |sin theta_6| and the elbow's bend above its sine.
    """
    try:
        status = elbow_status(arm, circle(arm, pose, gc), margin)
    except NoSolutionError:
        return "UNREACHABLE", []
    if status != "OK":
        return status, []
    arcs = intersect(joint_arcs(arm, pose, gc, margin))
    return ("OK" if arcs else "LIMITS"), arcs


def allowed_at(arm: Arm, ring: Circle, psi: Array, margin: float = 0.0) -> NDArray[np.bool_]:
    """Whether the joints keep their limits and margins at arm angles (...), by solving for them."""
    theta = model_solution(ring, psi)
    q = arm.signs * (theta - arm.offsets)
    turns = np.ceil((arm.lower - ANGLE_TOLERANCE - q) / TURN)
    inside = (q + TURN * turns <= arm.upper + ANGLE_TOLERANCE).all(axis=-1)
    bends = np.sin(theta[..., [1, 3, 5]] - np.array([0.0, arm.straight_angle, 0.0]))
    return np.asarray(inside & (np.abs(bends) >= np.sin(margin)).all(axis=-1))


def feasible_by_sampling(arm: Arm, pose: Array, gc: int, margin: float = 0.0, samples: int = 3600) -> Arcs:
    """Feasible arcs by trying ``samples`` arm angles and bisecting between, to 1e-12 rad.

    Misses what is narrower than a sample; uses no equation of section 5.
    """
    ring = circle(arm, pose, gc)
    grid = np.linspace(-np.pi, np.pi, samples, endpoint=False)
    verdicts = allowed_at(arm, ring, grid, margin)
    points = []
    for k in np.flatnonzero(verdicts != np.roll(verdicts, -1)):
        low, high = grid[k], grid[k] + TURN / samples
        while high - low > 1e-12:
            middle = (low + high) / 2
            if allowed_at(arm, ring, middle, margin) == verdicts[k]:
                low = middle
            else:
                high = middle
        points.append(float(high))
    return arcs_from_test(points, lambda psi: bool(allowed_at(arm, ring, np.array(psi), margin)))


def nearest_end(arcs: Arcs, psi: float) -> float:
    """End of the arcs (at least one) nearest to psi on the circle, a lower end on a tie, rad in (-pi, pi]."""

    ends = [low for low, _ in arcs] + [high for _, high in arcs]
    return float(wrap(min(ends, key=lambda end: abs(float(wrap(end - psi))))))


def resolve(
    psi: float,
    arcs: Arcs,
    k: float,
    alpha: float,
    outside: Literal["nearest", "stop"] = "nearest",
) -> float | None:
    """Next arm angle in (-pi, pi], rad, Eq. (36) on the circle; None where there is none.

    On the full circle nothing repels. Outside of all arcs ``nearest`` goes to the nearest end
    and ``stop`` gives up.
    """
    if arcs == FULL:
        return float(wrap(psi))
    for low, high in arcs:
        lifted = low + (psi - low + ANGLE_TOLERANCE) % TURN - ANGLE_TOLERANCE
        if lifted <= high + ANGLE_TOLERANCE:
            width = high - low
            if width == 0:
                return float(wrap(psi))
            part = min(max((lifted - low) / width, 0.0), 1.0)
            push = np.exp(-alpha * part) - np.exp(-alpha * (1 - part))
            return float(wrap(low + width * (part + k / 2 * push)))
    return nearest_end(arcs, psi) if arcs and outside == "nearest" else None
