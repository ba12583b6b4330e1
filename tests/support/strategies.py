"""What the laws are tried on: arms, postures by regime, transforms."""

from __future__ import annotations

import functools
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

import armangle as aa
from armangle.models.catalogue import srs_catalogue
from support import draw

Array = NDArray[np.float64]

TURN = 2 * np.pi
REGIMES = ("uniform", "near_singular", "singular", "on_limit", "at_reach", "folded")
CATALOGUE = srs_catalogue()


def frame(rng: np.random.Generator) -> Array:
    """A random rigid transform with positions within 1 m, shape (4, 4)."""
    rotation, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    out = np.eye(4)
    out[:3, :3] = rotation * np.linalg.det(rotation)
    out[:3, 3] = rng.uniform(-1, 1, 3)
    return out


def generated_arm(seed: int) -> aa.Arm:
    """An arm with any lengths, elbow offsets, signs, zero offsets, limits, base and tool."""
    rng = np.random.default_rng(seed)
    middle, half = rng.uniform(-2, 2, 7) * rng.integers(0, 2, 7), rng.uniform(0.3, 4, 7)
    d_se, d_ew = rng.uniform(0.1, 0.5, 2)
    a_3, a_4 = rng.uniform(-0.1, 0.1, 2) * rng.integers(0, 2)
    signs = rng.choice([-1, 1], 7)
    offsets = rng.choice([0.0, np.pi / 2, -np.pi / 2, 0.3], 7)
    delta = np.arctan2(d_se * a_4 - a_3 * d_ew, a_3 * a_4 + d_se * d_ew)
    middle[3], half[3] = signs[3] * (delta - offsets[3]), rng.uniform(1.5, 3.5)  # so that it can stretch
    return aa.Arm(
        d_bs=rng.uniform(-0.2, 0.5), d_se=d_se, d_ew=d_ew, d_wf=rng.uniform(-0.1, 0.3), a_3=a_3, a_4=a_4,
        signs=signs, offsets=offsets, lower=middle - half, upper=middle + half,
        base=frame(rng), tool=frame(rng), name=f"generated_{seed}",
    )  # fmt: skip


@functools.cache
def arms() -> tuple[aa.Arm, ...]:
    """The whole catalogue, and twelve generated arms."""
    catalogue = [aa.Arm.from_catalogue(name) for name in CATALOGUE]
    return (*catalogue, *(generated_arm(seed) for seed in range(12)))


LINKS = {
    # d_se, d_ew, a_3, a_4, d_4 in m
    "forearm": (0.28, 0.0, 0.0, -0.28, 0.0), "forearm, longer": (0.3, 0.0, 0.02, 0.41, 0.0),
    "upper arm": (0.0, 0.35, 0.3, 0.0, 0.0), "upper arm, offset forearm": (0.0, 0.35, -0.25, 0.04, 0.0),
    "both": (0.0, 0.0, 0.3, -0.25, 0.0), "both, one way": (0.0, 0.0, -0.2, -0.33, 0.0),
    "hardly a length": (1e-7, 0.4, 0.3, 0.0, 0.0), "gap": (0.41, 0.31, 0.0, 0.0, 0.0114),
    "gap, links of one length": (0.4, 0.4, 0.0, 0.0, -0.02), "wide gap": (0.3, 0.4, 0.0, 0.0, 0.25),
    "gap and offsets": (0.3, 0.35, 0.045, -0.06, -0.1), "gap and slant": (0.3, 0.0, 0.0, 0.3, 0.05),
    "hardly a gap": (0.4, 0.39, 0.0, 0.0, 1e-9),
}  # fmt: skip
"""Elbows of every kind: links that are offset alone, d_se = 0 or d_ew = 0, and gaps d_4."""


def slanted(name: str, seed: int = 0) -> aa.Arm:
    """An arm with the elbow of this name in `LINKS` and random signs, zeros, limits and frames."""
    d_se, d_ew, a_3, a_4, d_4 = LINKS[name]
    rng = np.random.default_rng([seed, list(LINKS).index(name)])
    plain = aa.Arm(d_bs=0.2, d_se=d_se, d_ew=d_ew, d_wf=0.1, a_3=a_3, a_4=a_4, d_4=d_4)
    signs, offsets = rng.choice([-1, 1], 7), rng.choice([0.0, np.pi / 2, -np.pi / 2, 0.3], 7)
    middle, half = rng.uniform(-1, 1, 7), rng.uniform(1.0, 3.5, 7)
    middle[3] = signs[3] * (plain.geometry.delta - offsets[3])
    return plain.with_(
        signs=signs, offsets=offsets, lower=middle - half, upper=middle + half,
        base=frame(rng), tool=frame(rng), name=name,
    )  # fmt: skip


@functools.cache
def all_arms() -> tuple[aa.Arm, ...]:
    """The arms of `arms`, and one for each kind of elbow."""
    return (*arms(), *map(slanted, LINKS))


def in_every_regime(law: Callable[[aa.Arm, str], None]) -> Callable[[aa.Arm], None]:
    """Make one test of an arm that checks a law in each regime; a failure names the regime."""

    def of_arm(arm: aa.Arm) -> None:
        """Check the law for an arm in each regime."""
        for regime in REGIMES:
            try:
                law(arm, regime)
            except AssertionError as wrong:
                wrong.add_note(f"in the regime {regime}")
                raise

    of_arm.__name__, of_arm.__doc__, of_arm.__module__ = law.__name__, law.__doc__, law.__module__
    return of_arm


def unlimited(arm: aa.Arm) -> aa.Arm:
    """The same arm without limits."""
    return arm.with_(lower=None, upper=None)


def model_angles(arm: aa.Arm, q: Array) -> Array:
    """Model angles theta of joint values, rad, shape (..., 7)."""
    return np.asarray(arm.geometry.signs * q + arm.geometry.offsets)


def joint_values(arm: aa.Arm, theta: Array) -> Array:
    """Joint values q of model angles, rad, shape (..., 7)."""
    return np.asarray(arm.geometry.signs * (theta - arm.geometry.offsets))


def bends(arm: aa.Arm, q: Array) -> Array:
    """Angles theta_2, theta_4 - delta, theta_6 (..., 3); one is 0 or π at each singularity."""
    return model_angles(arm, q)[..., [1, 3, 5]] - np.array([0.0, arm.geometry.delta, 0.0])


def finite_limits(arm: aa.Arm) -> tuple[Array, Array]:
    """The limits, cut to -π and π where they are farther out, two arrays (7,)."""
    return np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)


def uniform(arm: aa.Arm, n: int, rng: np.random.Generator) -> Array:
    """Joint values anywhere within the limits, shape (n, 7)."""
    lower = np.where(np.isfinite(arm.lower), arm.lower, -np.pi)
    upper = np.where(np.isfinite(arm.upper), arm.upper, np.pi)
    return rng.uniform(lower, np.maximum(lower, upper), (n, 7))


def _bent(arm: aa.Arm, n: int, rng: np.random.Generator, bend: Array, chosen: NDArray[np.bool_]) -> Array:
    """Random joints whose angles (theta_2, theta_4 - delta, theta_6) are `bend` (n, 3) where `chosen`."""
    theta = model_angles(arm, uniform(arm, n, rng))
    straight = np.array([0.0, arm.geometry.delta, 0.0])
    theta[:, [1, 3, 5]] = np.where(chosen, bend + straight, theta[:, [1, 3, 5]])
    return joint_values(arm, theta)


def _some(n: int, rng: np.random.Generator) -> NDArray[np.bool_]:
    """A random choice of at least one of three, (n, 3)."""
    return (rng.integers(1, 8, n)[:, None] & np.array([1, 2, 4])) > 0


def near_singular(arm: aa.Arm, n: int, rng: np.random.Generator) -> Array:
    """One, two or three of the bends within 1e-3..1e-15 rad of 0 or pi, shape (n, 7)."""
    off = rng.choice([-1, 1], (n, 3)) * 10 ** rng.uniform(-15, -3, (n, 3))
    return _bent(arm, n, rng, rng.choice([0, np.pi], (n, 3)) + off, _some(n, rng))


def singular(arm: aa.Arm, n: int, rng: np.random.Generator) -> Array:
    """One, two or three of the bends exactly 0 or pi; other joints sometimes at multiples of pi/2, (n, 7)."""
    q = _bent(arm, n, rng, rng.choice([0, np.pi], (n, 3)), _some(n, rng))
    theta = model_angles(arm, q)
    plain = rng.random((n, 4)) < 0.3
    right = rng.integers(-2, 3, (n, 4)) * (np.pi / 2)
    theta[:, ::2] = np.where(plain, right, theta[:, ::2])
    return joint_values(arm, theta)


def on_limit(arm: aa.Arm, n: int, rng: np.random.Generator) -> Array:
    """Some joints exactly on a limit, shape (n, 7)."""
    q, side, chosen = uniform(arm, n, rng), rng.random((n, 7)) < 0.5, rng.random((n, 7)) < 0.4
    limit = np.where(side, arm.lower, arm.upper)
    return np.where(chosen & np.isfinite(limit), limit, q)


def at_reach(arm: aa.Arm, n: int, rng: np.random.Generator) -> Array:
    """Stretched, exactly or nearly, shape (n, 7)."""
    off = rng.choice([-1, 0, 1], (n, 3)) * 10 ** rng.uniform(-17, -6, (n, 3))
    return _bent(arm, n, rng, off, np.array([False, True, False]) & np.ones((n, 1), bool))


def folded(arm: aa.Arm, n: int, rng: np.random.Generator) -> Array:
    """Folded, exactly or nearly; with links of one length only nearly: psi does not exist there, (n, 7)."""
    least = -10 if arm.geometry.inner_reach < 1e-6 * arm.geometry.reach else -17
    off = rng.choice([-1, 1], (n, 3)) * 10 ** rng.uniform(least, -3, (n, 3))
    return _bent(arm, n, rng, np.pi + off, np.array([False, True, False]) & np.ones((n, 1), bool))


_MAKERS = dict(zip(REGIMES, (uniform, near_singular, singular, on_limit, at_reach, folded), strict=True))


def postures(arm: aa.Arm, regime: str, n: int, seed: int = 0) -> Array:
    """Joint values of a regime, shape (m, 7) with m <= n: those where the arm angle exists. Bends that a
    regime sets may lie beyond the limits.
    """
    rng = draw.generator(seed, REGIMES.index(regime))
    q = _MAKERS[regime](arm, n, rng)
    return q[~np.isnan(arm.forward(q, on_error="nan")[1])]
