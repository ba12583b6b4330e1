"""One arm in many threads at once: the bits of each call are those of a call alone."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import pytest

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
    "inverse": lambda: ARM.inverse(POSE, PSI, GC),
    "inverse, one by one": lambda: np.array([ARM.inverse(*each) for each in zip(POSE, PSI, GC, strict=True)]),
    "jacobian": lambda: ARM.jacobian(Q),
    "feasible": lambda: ARM.feasible(POSE, GC).intervals,
    "arc algebra": lambda: (~ARM.feasible(POSE, GC) | aa.ArcSet([[0.0, 0.1]])).intervals,
    "joint function": lambda: ARM.joint_function(POSE[0], int(GC[0]), 3).value(PSI),
    "resolve": lambda: aa.resolve(ARM, POSE, PSI, GC).psi,
    "step": lambda: aa.step(ARM, Q[0], POSE[0]).q,
    "follow": lambda: aa.follow(ARM, LINE, start=Q[0]).q,
    "catalogue": lambda: aa.Arm.from_catalogue("kuka_iiwa7_r800").upper,
}


@pytest.mark.parametrize("name", CALLS)
def test_concurrent_calls_give_the_bits_of_a_call_alone(name: str) -> None:
    alone = CALLS[name]()
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda _: CALLS[name](), range(40)))
    for result in together:
        assert np.array_equal(result, alone, equal_nan=True)


def test_different_calls_at_once_do_not_disturb_each_other() -> None:
    names = list(CALLS)
    alone = {name: CALLS[name]() for name in names}
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda name: (name, CALLS[name]()), names * 10))
    assert all(np.array_equal(result, alone[name], equal_nan=True) for name, result in together)


@pytest.mark.parametrize("threads", [0, 2, 3, 7, 64])
def test_the_number_of_threads_does_not_change_a_bit(threads: int) -> None:
    assert np.array_equal(ARM.forward(Q, threads=threads)[1], PSI)
    assert np.array_equal(ARM.inverse(POSE, PSI, GC, threads=threads), ARM.inverse(POSE, PSI, GC))
    assert np.array_equal(ARM.jacobian(Q, threads=threads), ARM.jacobian(Q))
    assert ARM.feasible(POSE, GC, threads=threads) == ARM.feasible(POSE, GC)
    assert ARM.joint_feasible(POSE, GC, threads=threads) == ARM.joint_feasible(POSE, GC)


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_first_problem_is_reported_whichever_thread_meets_one(threads: int) -> None:
    poses = POSE.copy()
    poses[[70, 190, 299], 0, 3] = np.nan
    with pytest.raises(aa.NotFiniteError, match=r"pose\[70\]"):
        ARM.inverse(poses, PSI, GC, threads=threads)
    with pytest.raises(aa.NotFiniteError, match=r"pose\[70\]"):
        ARM.feasible(poses, GC, threads=threads)
