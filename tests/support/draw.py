"""How many random examples a law draws, and from which seed: the suite's own, or those of `make laws`."""

from __future__ import annotations

import os

import numpy as np

COUNT = int(os.environ.get("ARMANGLE_LAWS_COUNT", 0))
"""Examples of each law, where the law itself would draw fewer."""

SEED = int(os.environ.get("ARMANGLE_LAWS_SEED", 0))
"""Added to the seed of every law; 0 draws what the suite always draws."""


def count(own: int, arms: int = 1) -> int:
    """The number of examples to draw: `own`, or COUNT shared by `arms` if that is more."""
    return max(own, -(-COUNT // arms))


def generator(*own: int) -> np.random.Generator:
    """Random numbers from a law's own seed, different for each SEED."""
    return np.random.default_rng([*own, SEED] if SEED else list(own))


def header() -> str:
    """The first line of a test report, with which the run can be repeated."""
    return f"laws: at least {COUNT} examples, ARMANGLE_LAWS_SEED={SEED}"
