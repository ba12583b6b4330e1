"""Arms of every family, and what their laws share: joints within limits or far from singularities, links."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import armangle as aa
from armangle.models.catalogue import offset_catalogue

from .calibrated import calibrated

MIRRORED = aa.Arm(
    a_1=0.117, d_bs=0.3, d_se=0.35, d_ew=0.32, d_wf=0.15, a_3=0.04, a_4=-0.03, signs=[1, -1, 1, 1, -1, 1, 1],
    offsets=[0.3] * 7, lower=[-2.0] * 7, upper=[2.2] * 7, base=aa.pose([0.1, 0.2, 0.3], rpy=[0.1, 0.2, 0.3]),
    tool=aa.pose([0.0, 0.1, 0.2], rpy=[0.3, -0.2, 0.1]), name="offset shoulder, elbow offsets",
)  # fmt: skip
EXACT = [aa.Arm.from_catalogue(name) for name in ("kuka_iiwa7_r800", "openarm_v10")]
OFFSET = [aa.Arm.from_catalogue(name) for name in ("franka_fr3", "ufactory_xarm7", "willow_garage_pr2_right")]
OFFSET.append(MIRRORED)
CALIBRATED = [calibrated("kinova_movo", 1.0, 1.0)]
OFFSET_CHAIN = [calibrated("franka_fr3", 1.0, 1.0), calibrated("fetch", 1.0, 1.0)]
CHAINS = [*CALIBRATED, *OFFSET_CHAIN]
CLOSED = [*EXACT, *OFFSET]
"""Those whose answers are closed forms, or complete searches."""

ARMS = [*CLOSED, *CHAINS]


def random_offset(rng: np.random.Generator, *, mirrored: bool, widest: float = 6.0) -> aa.Arm:
    """Return an arm with an offset wrist (shoulder if `mirrored`) of random lengths, signs, base and tool,
    and joint ranges of at most `widest` (rad).
    """
    middle, half = rng.uniform(-2, 2, 7), rng.uniform(0.2, widest / 2, 7)
    frames = [aa.pose(rng.uniform(-1, 1, 3), rpy=rng.uniform(-3, 3, 3)) for _ in range(2)]
    elbow = rng.uniform(-0.1, 0.1, 2) * rng.integers(0, 2)
    return aa.Arm(
        **{"a_1" if mirrored else "a_6": rng.uniform(0.01, 0.15) * rng.choice([-1, 1])},
        d_bs=rng.uniform(-0.5, 0.5), d_se=rng.uniform(0.2, 0.4), d_ew=rng.uniform(0.2, 0.4),
        d_wf=rng.uniform(-0.2, 0.2), a_3=elbow[0], a_4=elbow[1], signs=rng.choice([-1, 1], 7),
        offsets=rng.uniform(-2, 2, 7), lower=middle - half, upper=middle + half,
        base=frames[0], tool=frames[1],
    )  # fmt: skip


def _offsets() -> list[aa.Arm]:
    """Return the catalogue's and some random arms with an offset, every other one mirrored."""
    rng = np.random.default_rng(5)
    return [aa.Arm.from_catalogue(n) for n in offset_catalogue()] + [
        random_offset(rng, mirrored=bool(k % 2), widest=6.0 if k < 4 else 14.0) for k in range(6)
    ]


OFFSETS = _offsets()


def named(arm: aa.Arm) -> str:
    """Return a test's name for an arm."""
    return f"{arm.name} {arm.kind}"


def of(*lists: list[aa.Arm]) -> pytest.MarkDecorator:
    """Return the decorator of a law for the arms of these lists."""
    return pytest.mark.parametrize("arm", [arm for arms in lists for arm in arms], ids=named)


def within(arm: aa.Arm, rng: np.random.Generator, count: int, widest: float = np.pi) -> Any:
    """Return random joints (count, 7) within the limits, cut to ±`widest` (rad)."""
    return rng.uniform(np.maximum(arm.lower, -widest), np.minimum(arm.upper, widest), (count, 7))


def regular(arm: aa.Arm, rng: np.random.Generator, count: int) -> Any:
    """Return `count` joints far from singularities, also of the arm whose free joint is locked."""
    q = within(arm, rng, 20 * count)
    size = np.linalg.svd(arm.jacobian(q), compute_uv=False)[:, -1]
    if arm.redundancy != "arm_angle":
        rest = np.delete(arm.jacobian(q), int(arm.redundancy[-1]) - 1, axis=-1)
        size = np.minimum(size, np.linalg.svd(rest, compute_uv=False)[:, -1])
    return q[np.argsort(-size)[: 4 * count : 4]]


def tolerance(arm: aa.Arm) -> float:
    """Return by how much entries of a pose that joints hold may differ: more where a wrist has an offset."""
    if arm.redundancy == "arm_angle":
        return 1e-12
    return 1e-10 if arm.geometry.chain is None else 4e-12
