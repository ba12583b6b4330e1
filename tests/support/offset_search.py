"""A dense search along poses for arms with an offset: free joint x branch x place, by `inverse`."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

import armangle as aa

NEAR = 4
"""Places of the grid that the free joint may move from pose to pose."""


def can_follow(arm: aa.Arm, poses: np.ndarray, places: int = 121, most: float = 0.3) -> bool:
    """Whether a branch has solutions at all poses (n, 4, 4) with joint steps of at most `most` (rad), if the
    free joint has `places` places and moves at most NEAR of them from pose to pose (False proves nothing).
    """
    joint = int(arm.redundancy[-1]) - 1
    low, high = max(arm.lower[joint], -np.pi), min(arm.upper[joint], np.pi)
    free = low + (high - low) * (np.arange(places) + 0.5) / places
    q = arm.inverse(poses[:, None], free, on_error="nan")  # (n, places, 8, 7)
    reached = np.isfinite(q[0, :, :, 0])
    for before, here in pairwise(q):
        now = np.zeros_like(reached)
        for shift in range(-NEAR, NEAR + 1):
            moved = np.full_like(before, np.nan)
            came = np.zeros_like(reached)
            to = slice(max(shift, 0), places + min(shift, 0))
            of = slice(max(-shift, 0), places - max(shift, 0))
            moved[to], came[to] = before[of], reached[of]
            with np.errstate(invalid="ignore"):
                now |= came & (np.abs(here - moved).max(axis=-1) <= most)
        reached = now
        if not reached.any():
            return False
    return True


def straight_lines(arm: aa.Arm, count: int, length: float, seed: int) -> list[tuple[np.ndarray, aa.Line]]:
    """Return random joints, and from their pose a straight line of a length (m) in any direction."""
    rng, found = np.random.default_rng(seed), []
    low, high = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
    middle, half = 0.5 * (low + high), 0.45 * (high - low)
    for _ in range(count):
        q = rng.uniform(middle - half, middle + half)
        start = arm.forward(q)[0]
        way = rng.normal(size=3)
        end = start.copy()
        end[:3, 3] += way * (length / np.linalg.norm(way))
        found.append((q, aa.Line(start, end)))
    return found
