"""Limits that try to mislead the feasible arcs, and arm angles that ask where they are most likely wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

import armangle as aa
from support import draw
from support.strategies import REGIMES, TURN, Array, arms, postures, unlimited

POSES, ANGLES = 12, 80
NUDGES = np.array([0, 0, 1e-12, 5e-10, 3e-9, 1e-7, 1e-5])
WIDTHS = np.radians([0.5, 20, 90, 180, 200, 300, 359.9, 400])


@dataclass(frozen=True)
class Case:
    """An arm with misleading limits, poses (P, 4, 4), gc (P,) and arm angles (P, K) to try."""

    arm: aa.Arm
    pose: Array
    gc: Array
    psi: Array


def box(rng: np.random.Generator) -> tuple[Array, Array]:
    """Random joint ranges, many of one sign or beyond ±π, two arrays (7,)."""
    middle, width = rng.uniform(-4, 4, 7), rng.choice(WIDTHS, 7)
    return middle - width / 2, middle + width / 2


def tangent(arm: aa.Arm, pose: Array, gc: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Limits (7,) such that one limit of each joint is where the joint has an extreme or jumps at this pose.

    Or next to it, or at a multiple of a right angle; the other limit between 1e-7 and 10 rad away.
    """
    lower, upper = np.empty(7), np.empty(7)
    for j in range(7):
        function = aa.gradients.joint_function(arm, pose, gc, j + 1)
        special = np.concatenate([function.stationary, function.singular])
        if len(special) == 0 or rng.random() < 0.4:
            special = rng.uniform(-np.pi, np.pi, 2)
        at = function.value(rng.choice(special)) + rng.choice([-1, 1]) * rng.choice(NUDGES)
        if rng.random() < 0.15:
            at = rng.integers(-2, 3) * np.pi / 2
        at += TURN * rng.integers(-1, 2)
        other = at + rng.choice([-1, 1]) * 10 ** rng.uniform(-7, 1)
        lower[j], upper[j] = min(at, other), max(at, other)
    return lower, upper


def limits(arm: aa.Arm, pose: Array, gc: int, rng: np.random.Generator) -> tuple[Array, Array]:
    """Limits chosen to mislead, for some joints those of the arm itself, (7,) each."""
    lower, upper = tangent(unlimited(arm), pose, gc, rng) if rng.random() < 0.6 else box(rng)
    if rng.random() < 0.3:
        own = rng.random(7) < 0.5
        lower, upper = np.where(own, arm.lower, lower), np.where(own, arm.upper, upper)
    return lower, upper


def angles(arm: aa.Arm, pose: Array, gc: Array, rng: np.random.Generator) -> Array:
    """Arm angles (P, K): a third random, the others 1e-12 to 0.3 rad from an end of some joint's arcs."""
    ends = arm.feasible(pose, gc, per_joint=True).intervals.reshape(len(pose), -1)
    ends = np.concatenate([ends, np.full((len(pose), 1), np.nan)], axis=1)
    anywhere = rng.uniform(-np.pi, np.pi, (len(pose), ANGLES))
    chosen = np.take_along_axis(ends, rng.integers(0, ends.shape[1], anywhere.shape), axis=1)
    side = rng.choice([-1, 1], anywhere.shape) * 10 ** rng.uniform(-12, -0.5, anywhere.shape)
    return np.where(np.isnan(chosen) | (rng.random(anywhere.shape) < 1 / 3), anywhere, chosen + side)


def cases(seed: int, count: int) -> Iterator[Case]:
    """`count` cases over all arms and regimes, the same for the same seed."""
    rng = draw.generator(seed)
    for k in range(count):
        arm, regime = arms()[k % len(arms())], REGIMES[rng.integers(len(REGIMES))]
        free = unlimited(arm)
        q = postures(free if rng.random() < 0.5 else arm, regime, POSES, seed=seed * count + k)
        pose, _, own = free.forward(q)
        gc = np.where(rng.random(len(q)) < 0.7, own, rng.integers(0, 8, len(q)))
        lower, upper = limits(arm, pose[0], int(gc[0]), rng)
        limited = arm.with_(lower=lower, upper=upper)
        yield Case(limited, pose, gc, angles(limited, pose, gc, rng))
