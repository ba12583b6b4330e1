"""Arcs of nearly S-R-S arms beside brute force that uses nothing of the package but an arm's numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

import armangle as aa
from armangle.models.catalogue import srs_catalogue
from support.calibrated import Array, off, own_links
from support.laws import circle_gap, members
from support.limit_cases import box

CLEAR = 1e-9  # rad of a joint: nearer to a limit nothing is decided
MET = 1e-10  # of a posture: m and rad
TURN = 2 * np.pi
NUDGES = np.array([1e-7, 1e-5, 1e-3, 0.1])
STARTS = 6
SINGULAR = 0.1  # sine of theta_2, theta_4 - delta, theta_6: nearer to 0 a second posture is looked for
# of that sine, and how far joints about one axis turn: where it may be
BESIDE = ((0.1, np.pi), (0.5, np.pi), (3.0, np.pi), (1.0, np.pi / 2), (1.0, -np.pi / 2))
MOST = 12  # arm angles of a circle at which one is looked for, each hinge


@dataclass
class Verdict:
    """How many arm angles were tested, how many are decided, and sentences on those that are wrong."""

    samples: int = 0
    decided: int = 0
    inside: int = 0
    unproven: int = 0
    by_newton: int = 0
    wrong: list[str] = field(default_factory=list)

    def add(self, other: Verdict) -> None:
        """Add the numbers of another verdict."""
        for name in ("samples", "decided", "inside", "unproven", "by_newton"):
            setattr(self, name, getattr(self, name) + getattr(other, name))
        self.wrong += other.wrong


@dataclass(frozen=True)
class Case:
    """A calibrated arm with misleading limits, a pose, a branch."""

    arm: aa.Arm
    name: str
    pose: Array
    gc: int


def turned(angle: Array) -> Array:
    """Rotations about z, (..., 4, 4)."""
    out = np.zeros((*angle.shape, 4, 4))
    out[..., 0, 0] = out[..., 1, 1] = np.cos(angle)
    out[..., 1, 0] = np.sin(angle)
    out[..., 0, 1] = -out[..., 1, 0]
    out[..., 2, 2] = out[..., 3, 3] = 1.0
    return out


def walked(arm: aa.Arm, q: Array) -> tuple[Array, Array, Array]:
    """Tip poses (n, 4, 4), joint axes and points (n, 7, 3) of the chain at joints (n, 7)."""
    pose, axes, points = np.broadcast_to(arm.geometry.chain[0], (len(q), 4, 4)), [], []
    for joint in range(7):
        axes.append(pose[:, :3, 2])
        points.append(pose[:, :3, 3])
        pose = pose @ turned(q[:, joint]) @ arm.geometry.chain[joint + 1]
    return pose, np.stack(axes, axis=1), np.stack(points, axis=1)


def elbow_angles(arm: aa.Arm, pose: Array, q: Array) -> Array:
    """The arm angles (n,) at joints (n, 7) of one pose, from the direction of the elbow axis about
    shoulder-wrist.
    """
    flange = np.linalg.inv(arm.base) @ pose @ np.linalg.inv(arm.tool)
    p = flange[:3, 3] - arm.geometry.d_wf * flange[:3, 2] - [0.0, 0.0, arm.geometry.d_bs]
    w = p / np.linalg.norm(p)
    z = np.array([p[1], -p[0], 0.0]) / np.hypot(p[0], p[1])
    s, c = (f((arm.geometry.signs * q + arm.geometry.offsets)[:, :3]) for f in (np.sin, np.cos))
    axis = np.stack([
        c[:, 0] * c[:, 1] * s[:, 2] + s[:, 0] * c[:, 2], s[:, 0] * c[:, 1] * s[:, 2] - c[:, 0] * c[:, 2],
        -s[:, 1] * s[:, 2],
    ], axis=1)  # fmt: skip
    return np.arctan2(axis @ np.cross(w, z), axis @ z)


def branches(arm: aa.Arm, q: Array) -> Array:
    """The branches (n,) of joints (n, 7)."""
    theta = arm.geometry.signs * q + arm.geometry.offsets
    theta[:, 3] -= arm.geometry.delta
    return (np.sin(theta[:, [1, 3, 5]]) < 0) @ [1, 2, 4]


def is_posture(arm: aa.Arm, pose: Array, psi: Array, gc: int, q: Array) -> Array:
    """Whether joints (n, 7) have the pose, psi (n,) and branch; False for rows of NaN."""
    known = np.isfinite(q).all(axis=1)
    at = walked(arm, np.where(known[:, None], q, 0.0))[0]
    met = np.abs(at - pose).max(axis=(1, 2)) <= MET
    angle = circle_gap(elbow_angles(arm, pose, np.where(known[:, None], q, 0.0)), psi) <= MET
    return known & met & angle & (branches(arm, np.where(known[:, None], q, 0.0)) == gc)


def margins(arm: aa.Arm, q: Array) -> Array:
    """Least distance (n,), rad, of a joint to its limits up to multiples of 2π; negative beyond, infinite if
    all joints turn fully.
    """
    middle, half = 0.5 * (arm.lower + arm.upper), 0.5 * (arm.upper - arm.lower)
    return np.where(half >= np.pi, np.inf, half - circle_gap(q, middle)).min(axis=1)


def newton(arm: aa.Arm, pose: Array, psi: Array, q: Array, passes: int = 30) -> Array:
    """Joints (n, 7) after steps of Newton's method towards the pose and psi (n,)."""
    for _ in range(passes):
        at, axes, points = walked(arm, q)
        spin = pose[:3, :3] @ np.swapaxes(at[:, :3, :3], 1, 2)
        vee = 0.5 * np.stack([spin[:, 2, 1] - spin[:, 1, 2], spin[:, 0, 2] - spin[:, 2, 0],
                              spin[:, 1, 0] - spin[:, 0, 1]], axis=1)  # fmt: skip
        now = elbow_angles(arm, pose, q)
        left = np.concatenate([pose[:3, 3] - at[:, :3, 3], vee, wrapped(psi - now)[:, None]], axis=1)
        rows = np.zeros((len(q), 7, 7))
        rows[:, :3] = np.swapaxes(np.cross(axes, at[:, None, :3, 3] - points), 1, 2)
        rows[:, 3:6] = np.swapaxes(axes, 1, 2)
        for joint in range(3):
            moved = q.copy()
            moved[:, joint] += 1e-7
            rows[:, 6, joint] = wrapped(elbow_angles(arm, pose, moved) - now) / 1e-7
        step = np.linalg.pinv(rows, rcond=1e-10) @ left[..., None]
        size = np.abs(step).max(axis=1, keepdims=True)
        q = q + (step * np.minimum(1.0, 0.5 / np.maximum(size, 1e-300)))[..., 0]
    return q


def wrapped(angle: Array) -> Array:
    """Angles in [-π, π)."""
    return np.asarray((angle + np.pi) % TURN - np.pi)


def found_from(arm: aa.Arm, pose: Array, psi: Array, gc: int, starts: Array) -> tuple[Array, Array]:
    """Joints by Newton's method from starts (n, 7), and which of them have converged to solutions."""
    q = newton(arm, pose, psi, starts)
    settled = np.abs(newton(arm, pose, psi, q, passes=1) - q).max(axis=1, initial=0.0) < 0.1 * CLEAR
    return q, settled & is_posture(arm, pose, psi, gc, q)


def beside_singular(arm: aa.Arm, psi: Array, q: Array) -> tuple[Array, Array]:
    """Starts (m, 7), and their psi (m,), near which second solutions may exist beside those at
    joints (n, 7).
    """
    zero = np.zeros(7)
    zero[3] = arm.geometry.delta
    theta = arm.geometry.signs * q + arm.geometry.offsets - zero
    angles, starts = [np.empty(0)], [np.empty((0, 7))]
    for hinge in (1, 3, 5):
        sine = np.sin(theta[:, hinge])
        near = np.flatnonzero(np.abs(sine) < SINGULAR)[:MOST]
        side = np.where(np.cos(theta[near, hinge]) > 0, 1.0, -1.0)
        for share, turn in BESIDE:
            start = theta[near]
            bent = np.arcsin(share * sine[near])
            start[:, hinge] = np.where(side > 0, bent, np.pi - bent)
            if hinge != 3:  # the neighbours of joint 2 or 6 share a turn
                start[:, hinge - 1] += turn
                start[:, hinge + 1] -= side * turn
            angles.append(psi[near])
            starts.append(arm.geometry.signs * (start + zero - arm.geometry.offsets))
    return np.concatenate(angles), np.concatenate(starts)


def cases(seed: int, count: int) -> Iterator[Case]:
    """At most `count` cases over all S-R-S arms of the catalogue, the same for the same seed."""
    names = srs_catalogue()
    for k in range(count):
        one = drawn(seed, k, names[(seed * count + k) % len(names)])
        if one is not None:
            yield one


def drawn(seed: int, number: int, name: str) -> Case | None:
    """The case drawn by two numbers for an arm; None if the drawn configuration has no arm angle."""
    rng = np.random.default_rng([79, seed, number])
    mm, mrad = 0.1 * 20 ** rng.random(), 0.1 * 50 ** rng.random()
    exact = aa.Arm.from_catalogue(name)
    arm = exact.with_(chain=off(own_links(exact), mm, mrad, rng))
    lower, upper = (np.clip(limit, -np.pi, np.pi) for limit in (arm.lower, arm.upper))
    pose, psi, gc = arm.forward(rng.uniform(lower, upper), on_error="nan")
    if not np.isfinite(psi):
        return None
    branch = int(gc if rng.random() < 0.7 else rng.integers(8))
    limited = arm.with_(**misleading(arm, pose, branch, rng))
    words = f"{name} {mm:.3g} mm {mrad:.3g} mrad ({seed}, {number})"
    return Case(limited, words, pose, branch)


def misleading(arm: aa.Arm, pose: Array, gc: int, rng: np.random.Generator) -> dict[str, Array]:
    """Limits as keywords of `with_`: random, or near values of joints at this pose; {} for the arm's own."""
    kind = rng.random()
    if kind < 0.3:
        return {}
    lower, upper = box(rng)
    if kind < 0.7:
        on = arm.inverse(pose, rng.uniform(-np.pi, np.pi), gc, on_error="nan", limits=False)
        if np.isfinite(on).all():
            near, far = rng.choice(NUDGES, 7), 10 ** rng.uniform(-2, 0.8, 7)
            side = rng.random(7) < 0.5
            lower = np.where(side, on - near, on - far)
            upper = np.where(side, on + far, on + near)
    own = rng.random(7) < 0.5
    return {"lower": np.where(own, arm.lower, lower), "upper": np.where(own, arm.upper, upper)}


def judge(case: Case, rng: np.random.Generator, angles: int) -> Verdict:
    """Compare a case's arcs with solutions at `angles` arm angles, random or near the ends of the arcs."""
    arm, pose, gc, out = case.arm, case.pose, case.gc, Verdict()
    arcs = arm.feasible(pose, gc)
    psi = rng.uniform(-np.pi, np.pi, angles)
    if len(arcs.intervals):
        beside = rng.choice(arcs.intervals.reshape(-1), angles)
        beside = beside + rng.choice([-1, 1], angles) * 10 ** rng.uniform(-12, -0.5, angles)
        psi = np.where(rng.random(angles) < 1 / 3, psi, wrapped(beside))
    held = members(arm.feasible(pose[None], [gc]), psi[None])[0]
    q = arm.inverse(pose, psi, gc, on_error="nan", limits=False)
    true = is_posture(arm, pose, psi, gc, q)
    out.samples = angles
    edge = np.concatenate([arcs.intervals.reshape(-1), [np.inf]])
    at_end = circle_gap(psi[:, None], np.where(np.isfinite(edge), edge, 100.0)[None]).min(axis=1) < 1e-9
    for at in np.flatnonzero(held & ~true & ~at_end):
        out.wrong.append(f"{case.name}: psi {psi[at]!r} is in an arc, and inverse gives no posture")
    found = [(psi[true], held[true], margins(arm, q[true]))]
    some = np.repeat(rng.integers(0, angles, 4), STARTS)
    more, starts = beside_singular(arm, psi[true], q[true])
    asked = np.concatenate([psi[some], more])
    starts = np.concatenate([rng.uniform(-np.pi, np.pi, (4 * STARTS, 7)), starts])
    many, good = found_from(arm, pose, asked, gc, starts)
    inside = members(arm.feasible(pose[None], [gc]), asked[None])[0]
    found.append((asked[good], inside[good], margins(arm, many[good])))
    out.by_newton = int(good.sum())
    for angle, inside, margin in found:
        decided = np.abs(margin) > CLEAR
        out.decided += int(decided.sum())
        out.inside += int((decided & inside).sum())
        for at in np.flatnonzero(decided & inside & (margin < 0)):
            out.wrong.append(f"{case.name}: psi {angle[at]!r} is in an arc, a joint {-margin[at]:g} beyond")
        missed = decided & ~inside & (margin > 0)
        if float(arcs.unproven) > 0.0:
            out.unproven += int(missed.sum())
            continue
        for at in np.flatnonzero(missed):
            out.wrong.append(f"{case.name}: psi {angle[at]!r} is in no arc, all joints {margin[at]:g} within")
    return out
