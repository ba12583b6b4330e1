"""Arms that plans are tried on."""

from __future__ import annotations

import numpy as np

import armangle as aa

IIWA = aa.Arm.from_catalogue("kuka_iiwa7_r800")
TURNING = aa.Arm(
    d_bs=0.3, d_se=0.35, d_ew=0.35, d_wf=0.1,
    lower=-np.radians([170, 120, 170, 120, 170, 120, 360]),
    upper=np.radians([170, 120, 170, 120, 170, 120, 360]),
)  # fmt: skip


def random_arm(rng: np.random.Generator) -> aa.Arm:
    """The iiwa, or an arm of random lengths, offsets, signs and narrow limits."""
    kind = rng.integers(0, 3)
    if kind == 0:
        return IIWA
    middle = rng.uniform(-0.6, 0.6, 7) * rng.integers(0, 2, 7)
    middle[3] += rng.choice([-1, 0, 1])
    half = rng.uniform(0.6, 2.9, 7)
    d_bs, d_se, d_ew, d_wf = rng.uniform(0.2, 0.5, 4)
    a_3, a_4 = rng.uniform(-0.05, 0.05, 2) * (kind - 1)
    return aa.Arm(
        d_bs=d_bs, d_se=d_se, d_ew=d_ew, d_wf=d_wf, a_3=a_3, a_4=a_4, signs=rng.choice([-1, 1], 7),
        lower=middle - half, upper=middle + half,
    )  # fmt: skip
