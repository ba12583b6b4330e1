"""One arm in many threads at once: the bits of each call are those of a call alone."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest
from support.threads import in_threads

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
COUNT = 300
RNG = np.random.default_rng(5)
Q = RNG.uniform(0.8 * ARM.lower, 0.8 * ARM.upper, (COUNT, 7))
POSE, PSI, GC = ARM.forward(Q)
LINE = np.repeat(POSE[:1], COUNT, axis=0)
LINE[:, 0, 3] += np.linspace(0, 0.02, COUNT)
CALLS: dict[str, Callable[[], Any]] = {
    "forward": lambda: ARM.forward(Q)[0],
    "inverse": lambda: ARM.inverse(POSE, PSI, GC, limits=False),
    "inverse, one by one": lambda: np.array(
        [ARM.inverse(*each, limits=False) for each in zip(POSE, PSI, GC, strict=True)]
    ),
    "jacobian": lambda: ARM.jacobian(Q),
    "feasible": lambda: ARM.feasible(POSE, GC).intervals,
    "arc algebra": lambda: (~ARM.feasible(POSE, GC) | aa.ArcSet([[0.0, 0.1]])).intervals,
    "joint function": lambda: aa.gradients.joint_function(ARM, POSE[0], int(GC[0]), 3).value(PSI),
    "resolve": lambda: aa.resolve(ARM, POSE, PSI, GC).psi,
    "step": lambda: aa.step(ARM, Q[0], POSE[0]).q,
    "follow": lambda: aa.follow(ARM, LINE, start=Q[0]).q,
    "plan": lambda: aa.plan(ARM, LINE[:60]).q,
    "catalogue": lambda: aa.Arm.from_catalogue("kuka_iiwa7_r800").upper,
}


@pytest.mark.parametrize("name", CALLS)
def test_concurrent_calls_give_the_bits_of_a_call_alone(name: str) -> None:
    """The same call from eight threads at once gives the bits of one alone."""
    alone = CALLS[name]()
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda _: CALLS[name](), range(40)))
    for result in together:
        assert np.array_equal(result, alone, equal_nan=True)


def test_different_calls_at_once_do_not_disturb_each_other() -> None:
    """Different calls from eight threads at once give the bits of each alone."""
    names = list(CALLS)
    alone = {name: CALLS[name]() for name in names}
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda name: (name, CALLS[name]()), names * 10))
    assert all(np.array_equal(result, alone[name], equal_nan=True) for name, result in together)


@pytest.mark.parametrize("threads", [0, 2, 3, 7, 64])
def test_the_number_of_threads_does_not_change_a_bit(threads: int) -> None:
    """Batches give the same bits with any number of threads."""
    assert np.array_equal(in_threads(threads, lambda: ARM.forward(Q))[1], PSI)
    assert np.array_equal(
        in_threads(threads, lambda: ARM.inverse(POSE, PSI, GC, limits=False)),
        ARM.inverse(POSE, PSI, GC, limits=False),
    )
    assert np.array_equal(in_threads(threads, lambda: ARM.jacobian(Q)), ARM.jacobian(Q))
    assert in_threads(threads, lambda: ARM.feasible(POSE, GC)) == ARM.feasible(POSE, GC)
    assert in_threads(threads, lambda: ARM.feasible(POSE, GC, per_joint=True)) == ARM.feasible(
        POSE, GC, per_joint=True
    )


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_first_problem_is_reported_whichever_thread_meets_one(threads: int) -> None:
    """With threads the error names the first wrong pose of a batch."""
    poses = POSE.copy()
    poses[[70, 190, 299], 0, 3] = np.nan
    with pytest.raises(aa.InputError, match=r"pose\[70\]"):
        in_threads(threads, lambda: ARM.inverse(poses, PSI, GC, limits=False))
    with pytest.raises(aa.InputError, match=r"pose\[70\]"):
        in_threads(threads, lambda: ARM.feasible(poses, GC))


def wavy(first: np.ndarray, shift: list[float]) -> np.ndarray:
    """Return 250 poses of one orientation along a wave that ends `shift` (m) away."""

    s = np.linspace(0.0, 1.0, 250)[:, None]
    poses = np.repeat(first[None], len(s), axis=0)
    poses[:, :3, 3] += s * shift + 0.05 * np.sin(2 * np.pi * s) * [1.0, 0.0, 0.3]
    return poses


NARROW = aa.Arm.from_catalogue("rokae_xmate_er3_pro")
WINDING = NARROW.with_(
    lower=np.where(np.arange(7) % 2, NARROW.lower, -7.48),
    upper=np.where(np.arange(7) % 2, NARROW.upper, 11.35),
)
FAR = np.array([2.303, -0.209, 1.144, 0.315, 1.567, -1.238, 1.788])
"""From here the first branches take most of what a plan may try: it is not the same who looks first."""


@pytest.mark.turns(3)
@pytest.mark.parametrize("arm, q, shift, given", [
    (ARM, Q[1], [0.1, 0.05, -0.1], {}),
    (ARM, Q[1], [0.1, 0.05, -0.1], {"start": Q[1]}),
    (ARM, Q[2], [0.6, 0.4, 0.9], {}),
    (ARM, Q[1], [0.1, 0.05, -0.1], {"objective": aa.Objective(duration=10, acceleration=5.0)}),
    (WINDING, FAR, [0.003, 0.187, -0.022], {"start": FAR}),
    (WINDING, FAR, [0.003, 0.187, -0.022], {"allowed": lambda pose: aa.ArcSet([[-2.0, 2.5]])}),
], ids=["free", "from a start", "no way", "fast", "winding", "allowed by a function"])  # fmt: skip
def test_a_plan_is_the_same_by_one_thread_and_by_many(
    arm: aa.Arm, q: np.ndarray, shift: list[float], given: dict[str, Any]
) -> None:
    """`plan` gives the same bits and diagnosis with any number of threads."""
    poses = wavy(arm.forward(q)[0], shift)
    alone = in_threads(1, lambda: aa.plan(arm, poses, **given))
    for threads in (0, 2, 3, 8):
        many = in_threads(threads, lambda: aa.plan(arm, poses, **given))
        assert np.array_equal(many.q, alone.q, equal_nan=True)
        assert repr(many.diagnosis) == repr(alone.diagnosis)
        assert np.array_equal(many.uncertified, alone.uncertified)
