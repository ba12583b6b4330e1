"""Ctrl-C ends every long call at once and harms nothing; and long calls say how far they are."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from support.threads import in_threads

import armangle as aa
from armangle._progress import progressing

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
FR3 = aa.Arm.from_catalogue("franka_fr3")
RNG = np.random.default_rng(42)
Q = RNG.uniform(0.8 * ARM.lower, 0.8 * ARM.upper, (7, 7))
POSE = ARM.forward(Q)[0]
POSES = POSE.repeat(30_000, axis=0)  # far longer than the 0.05 s between two looks at signals
FR3_Q = RNG.uniform(0.8 * FR3.lower, 0.8 * FR3.upper, (7, 7))
FR3_POSES = FR3.forward(FR3_Q)[0].repeat(2000, axis=0)
TICKS = POSE[:1].repeat(300_000, axis=0)


PLANNED = np.repeat(POSE[:1], 60_000, axis=0)
PLANNED[:, :3, 3] += 0.05 * np.sin(np.linspace(0.0, 2 * np.pi, len(PLANNED)))[:, None] * [1.0, 0.0, 0.3]
TILTED = ARM.with_(tool=aa.pose([0.0, 0.05, 0.1], rpy=[0.5, 0.0, 0.0]))
WAY = TILTED.forward(Q[:1])[0].repeat(6, axis=0)
WAY[:, 0, 3] += np.linspace(0.0, 0.02, len(WAY))
ROWS = aa.JointPath.from_joints(ARM, 0.5 * Q, between="joints")
SOME_ROWS = aa.JointPath.from_joints(ARM, 0.5 * Q[:2], between="joints")


def tracker() -> aa.Tracker:
    """A tracker at rest at Q[0]."""
    out = aa.Tracker(ARM)
    out.start(Q[0])
    return out


TRACKER = tracker()
LONG: dict[str, Callable[..., Any]] = {
    "solve": lambda **more: ARM.solve(POSES, **more),
    "solve in threads": lambda **more: in_threads(3, lambda: ARM.solve(POSES, **more)),
    "solutions": lambda **more: ARM.solutions(POSES, **more),
    "best": lambda **more: ARM.solve(POSES, **more, prefer="margin"),
    "feasible": lambda **more: ARM.feasible(POSES, 0, **more),
    "feasible of all branches": lambda **more: ARM.feasible(POSES, **more),
    "offset solve": lambda **more: FR3.solve(FR3_POSES, **more),
    "offset feasible": lambda **more: FR3.feasible(FR3_POSES, 0, **more),
    "follow": lambda **more: aa.follow(ARM, TICKS, start=Q[0], **more),
    "run": lambda **more: TRACKER.run(TICKS, **more),
    "place": lambda **more: aa.place(ARM, POSE, np.linspace(-1, 1, 300), np.linspace(-1, 1, 300), **more),
    "plan": lambda **more: in_threads(1, lambda: aa.plan(ARM, PLANNED, **more)),
    "plan in threads": lambda **more: in_threads(2, lambda: aa.plan(ARM, PLANNED, **more)),
    "plan of rolls": lambda **more: aa.plan(TILTED, WAY, roll="free", **more),
    "follow of rolls": lambda **more: aa.follow(TILTED, WAY, start=Q[0], roll="free", **more),
    "retime": lambda **more: aa.retime(ROWS, acceleration=5.0, **more),
    "retime with jerk": lambda **more: aa.retime(ROWS, acceleration=5.0, jerk=50.0, **more),
}


@pytest.fixture(autouse=True)
def _listening() -> Iterator[None]:
    """Let SIGINT raise KeyboardInterrupt in each test, also in a background process, and restore it."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.parametrize("name", LONG)
def test_a_signal_ends_a_batch_before_all_is_done(name: str) -> None:
    """SIGINT ends every long call by KeyboardInterrupt before its end, and later calls are right."""
    told: list[tuple[int, int]] = []
    begun, sent = threading.Event(), threading.Event()

    def interrupt() -> None:
        """Send SIGINT when the call has begun."""
        begun.wait()
        os.kill(os.getpid(), signal.SIGINT)
        sent.set()

    def tell(done: int, total: int) -> None:
        """Keep what is reported, and let the signal come."""
        told.append((done, total))
        begun.set()
        if 2 * done > total:  # a fast machine waits for the other thread here
            sent.wait()

    before = TRACKER.q.copy()
    thread = threading.Thread(target=interrupt)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        LONG[name](progress=tell)
        begun.set()  # where nothing was told the signal comes now
        thread.join()
    thread.join()
    assert told and told[-1][0] < told[-1][1]
    assert np.array_equal(TRACKER.q, before)
    assert np.array_equal(ARM.solve(POSE, seed=Q).q, ARM.solve(POSE, seed=Q).q)


@pytest.mark.parametrize("name", LONG)
def test_what_progress_raises_ends_a_call(name: str) -> None:
    """What `progress` raises ends every long call."""

    def refuse(done: int, total: int) -> None:
        """Raise an error."""
        raise ZeroDivisionError

    before = TRACKER.q.copy()
    with pytest.raises(ZeroDivisionError):
        LONG[name](progress=refuse)
    assert np.array_equal(TRACKER.q, before)


SHORT: dict[str, Callable[..., Any]] = {
    "solve": lambda **more: ARM.solve(POSE, seed=Q, **more).q,
    "solve one": lambda **more: ARM.solve(POSE[0], seed=Q[0], **more).q,
    "solutions": lambda **more: ARM.solutions(POSE, seed=Q, **more).q,
    "best": lambda **more: ARM.solve(POSE, **more, prefer="margin").q,
    "feasible": lambda **more: ARM.feasible(POSE, 0, **more).intervals,
    "feasible of all branches": lambda **more: ARM.feasible(POSE, **more).intervals,
    "offset solve": lambda **more: FR3.solve(FR3_POSES[:5], **more).q,
    "offset feasible": lambda **more: FR3.feasible(FR3_POSES[:5], **more).intervals,
    "follow": lambda **more: aa.follow(ARM, TICKS[:50], start=Q[0], **more).q,
    "run": lambda **more: tracker().run(TICKS[:50], **more),
    "place": lambda **more: aa.place(ARM, POSE, [0.0, 0.1], [0.0], **more).reached,
    "plan": lambda **more: aa.plan(ARM, PLANNED[:50], **more).q,
    "plan a short one": lambda **more: (
        aa.plan(ARM, PLANNED[:50], objective=aa.Objective(duration=1.0), **more).q
    ),
    "plan of rolls": lambda **more: aa.plan(TILTED, WAY, roll="free", **more).q,
    "follow of rolls": lambda **more: aa.follow(TILTED, WAY, start=Q[0], roll="free", **more).q,
    "retime": lambda **more: aa.retime(ROWS, acceleration=5.0, **more).q,
    "retime with jerk": lambda **more: aa.retime(SOME_ROWS, acceleration=5.0, jerk=50.0, **more).q,
}


@pytest.mark.turns(2)
@pytest.mark.parametrize("name", SHORT)
def test_the_end_is_told_and_the_answer_is_the_same(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """`progress` gets rising numbers up to the end, True prints them, and results do not depend on it."""
    told: list[tuple[int, int]] = []
    found = SHORT[name](progress=lambda done, total: told.append((done, total)))
    assert np.array_equal(found, SHORT[name](), equal_nan=True)
    assert told == sorted(told) and told[-1][0] == told[-1][1] > 0
    assert np.array_equal(SHORT[name](progress=True), found, equal_nan=True)
    assert "100 %" in capsys.readouterr().err
    assert np.array_equal(SHORT[name](progress=False), found, equal_nan=True)
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("name", [name for name in SHORT if name.startswith(("plan", "retime", "follow of"))])
def test_who_asked_in_this_thread_is_told_of_the_whole_call(name: str) -> None:
    """`progressing` reports a whole call as one: numbers rise and the end comes once."""
    told: list[tuple[int, int]] = []
    with progressing(lambda done, total: told.append((done, total))):
        SHORT[name]()
    assert told == sorted(told) and [done == total for done, total in told].count(True) == 1


def test_what_progress_calls_tells_nothing() -> None:
    """Calls made within `progress` report nothing themselves."""
    told: list[tuple[int, int]] = []

    def tell(done: int, total: int) -> None:
        """Keep what is reported, and call the library."""
        told.append((done, total))
        ARM.feasible(POSE[:3], 0)

    ARM.solve(POSE, seed=Q, progress=tell)
    assert {total for _, total in told} == {len(POSE)}
