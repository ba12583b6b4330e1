"""Run `armangle.Tracker` beside mink and pink: the same hands, the same bounds, the same hand filter.

    python benchmarks/tracking.py [--peers PYTHON] [--arms NAME ...] [--rates 250 90 1000] [--seeds 8]
                                  [--ticks 4000] [--write]

PYTHON is an interpreter with ``pip install mink pin-pink daqp``. A hand lasts 10 s, and no more than the
ticks. Per stream: RMS distance of the tool from the hand without noise, over the ticks at which the hand has
been in reach for 0.5 s; ticks that break a bound on speed, acceleration or position (1e-6 relative); freezes
(0.5 s without motion, more than 20 mm from a hand in reach); programmes without solution; CPU time of a tick,
one call each and in one call of `run`, the mean of a stream and the median of the streams. A stream is ahead
if its RMS distance is less than that of the best of the others on it, "within bounds" of those of them that
break no bound on it. The first arm at the first rate has a
table of its own, all have a row.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import machine
import numpy as np
import report
from numpy.typing import NDArray

import armangle as aa

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent / "tests"))
from support import streams  # noqa: E402  # the same targets as the tests'

Floats = NDArray[np.float64]

ACCELERATION = 10.0
LENGTH = 0.2  # m that a radian counts as: the tracker's own, and that of adapters/track_worker.py
SLACK = 1e-6
FROZEN, FAR, STILL = 0.5, 0.02, 1e-6  # s, m, rad/s
OURS = "armangle"
ARMS = ("kuka_iiwa14_r820", "realman_rm75_b", "openarm_v10")
SECONDS = 10.0  # that a hand lasts
ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True)
class Row:
    """One method on one stream."""

    rms: float
    p99: float
    turn: float
    violations: int
    freezes: int
    failed: int
    micros: float
    loop: float | None = None  # us of CPU time a tick of a whole stream in one call

    @property
    def weighed(self) -> float:
        """RMS of what all of the methods make small: the distance with a radian as LENGTH m, mm."""
        return float(np.hypot(self.rms, 1e3 * LENGTH * np.radians(self.turn)))


def judge(arm: aa.Arm, stream: streams.Stream, start: Floats, q: Floats, failed: int, micros: float) -> Row:
    """Return what a motion is worth, from its joints alone."""
    dt = stream.dt
    metres, radians = streams.errors(arm, q, stream.true)
    ok = streams.judged(arm, stream.true, dt)
    v = np.diff(q, axis=0, prepend=start[None]) / dt
    a = np.diff(v, axis=0, prepend=np.zeros((1, 7))) / dt
    broken = (np.abs(v) > arm.velocity * (1 + SLACK)).any(1) | (np.abs(a) > ACCELERATION * (1 + SLACK)).any(1)
    broken |= ((q < arm.lower - SLACK) | (q > arm.upper + SLACK)).any(1)
    stuck = (np.abs(v).max(1) < STILL) & ok & (metres > FAR)
    window = round(FROZEN / dt)
    runs = np.convolve(stuck, np.ones(window), "valid") >= window
    return Row(
        float(np.sqrt((metres[ok] ** 2).mean())) * 1e3,
        float(np.quantile(metres[ok], 0.99)) * 1e3,
        float(np.degrees(np.sqrt((radians[ok] ** 2).mean()))),
        int(broken.sum()),
        int((np.diff(runs.astype(int), prepend=0) > 0).sum()),
        failed,
        micros,
    )


def ours(arm: aa.Arm, stream: streams.Stream, start: Floats) -> Row:
    """Return the tracker's row."""
    tracker = aa.Tracker(arm, stream.dt, acceleration=ACCELERATION, filter=aa.HandFilter())
    tracker.start(start)
    q = np.empty((len(stream.samples), 7))
    before = time.thread_time()
    for i, pose in enumerate(stream.samples):
        q[i] = tracker.step(pose).q
    row = judge(arm, stream, start, q, 0, (time.thread_time() - before) / len(q) * 1e6)
    tracker.start(start)
    before = time.thread_time()
    tracker.run(stream.samples)
    return replace(row, loop=(time.thread_time() - before) / len(q) * 1e6)


def peers(
    python: str, module: str, arm: aa.Arm, given: dict[str, streams.Stream], start: Floats
) -> dict[str, dict[str, Row]]:
    """Return a peer's rows by method and stream."""
    one = next(iter(given.values()))
    with tempfile.TemporaryDirectory() as folder:
        urdf, problem, out = (Path(folder) / name for name in ("arm.urdf", "streams.npz", "out.npz"))
        urdf.write_text(arm.to_urdf(), encoding="utf-8")
        filtered = {key: aa.HandFilter().smooth(s.samples, s.dt) for key, s in given.items()}
        np.savez(problem, start=start, dt=one.dt, lower=arm.lower, upper=arm.upper, velocity=arm.velocity,
                 acceleration=np.full(7, ACCELERATION), **filtered)  # fmt: skip
        command = [python, "-m", "adapters.track_worker", module, str(problem), str(urdf), str(out)]
        subprocess.run(command, check=True, cwd=HERE, env=os.environ | ONE_THREAD)
        found = dict(np.load(out))
    rows: dict[str, dict[str, Row]] = {}
    for name, key in {tuple(full.split("|")[:2]) for full in found}:
        result = {what: found[f"{name}|{key}|{what}"] for what in ("q", "seconds", "failed")}
        micros = float(result["seconds"]) * 1e6
        rows.setdefault(name, {})[key] = judge(
            arm, given[key], start, result["q"], int(result["failed"]), micros
        )
    return rows


def behind(
    rows: dict[str, dict[str, Row]], keys: list[str], what: str = "rms", *, within_bounds: bool = False
) -> list[str]:
    """Return the streams in which ours is not less than the best of the others (of those within bounds)."""
    lost = []
    for key in keys:
        others = [rows[name][key] for name in rows if name != OURS]
        best = min(
            (getattr(row, what) for row in others if not (within_bounds and row.violations)), default=np.inf
        )
        if not getattr(rows[OURS][key], what) < best:
            lost.append(key)
    return lost


def median(rows: dict[str, Row], what: str) -> float:
    """Return the median of all streams."""
    return float(np.median([getattr(row, what) for row in rows.values()]))


def means(rows: dict[str, dict[str, Row]], scenario: str, what: str) -> dict[str, float]:
    """Return the mean of a scenario's streams by method."""
    return {
        name: float(np.mean([getattr(row, what) for key, row in of.items() if key.startswith(scenario)]))
        for name, of in rows.items()
    }


def total(rows: dict[str, Row], what: str) -> int:
    """Return the sum of all streams."""
    return sum(getattr(row, what) for row in rows.values())


def table(rows: dict[str, dict[str, Row]]) -> str:
    """Return one arm at one rate in Markdown, the best RMS error of each scenario in bold."""
    names = list(rows)
    lines = []
    for scenario in streams.SCENARIOS:
        keys = [key for key in rows[OURS] if key.startswith(scenario)]
        mean, tail, turn = (means(rows, scenario, what) for what in ("rms", "p99", "turn"))
        best = min(mean, key=lambda name: mean[name])
        cells = [f"{mean[n]:.3g} / {tail[n]:.3g} / {turn[n]:.3g}" for n in names]
        cells = [f"**{cell}**" if n == best else cell for n, cell in zip(names, cells, strict=True)]
        lines.append([scenario, *cells, f"{len(keys) - len(behind(rows, keys))} of {len(keys)}"])
    for what, label in (
        ("violations", "ticks that break a bound"),
        ("freezes", "freezes"),
        ("failed", "no solution"),
    ):
        lines.append([label, *(str(total(rows[n], what)) for n in names), ""])
    lines.append(["µs a tick, one call each", *(f"{median(rows[n], 'micros'):.3g}" for n in names), ""])
    lines.append(["µs a tick, all in one `run`", f"{median(rows[OURS], 'loop'):.3g}", *([""] * len(names))])
    return report.table(["RMS mm / 99 % mm / RMS degrees", *names, "streams ahead"], lines)


SUMMARY = (
    "arm", "ticks a second", "scenarios ahead", "streams ahead", "within bounds", "with rotation",
    "behind in", "freezes, its : theirs", "bounds broken, its : theirs", "µs, one call : `run` : theirs",
    "times less, one call : `run`",
)  # fmt: skip


def summary(arm: str, rate: float, rows: dict[str, dict[str, Row]]) -> list[str]:
    """Return the row of one arm at one rate: theirs are the fastest of them, and the sums of each."""
    own, others = rows[OURS], [rows[name] for name in rows if name != OURS]
    lost = behind(rows, list(own))
    mean = [means(rows, scenario, "rms") for scenario in streams.SCENARIOS]
    led = [of[OURS] == min(of.values()) for of in mean]
    one, loop = median(own, "micros"), median(own, "loop")
    theirs = min((median(row, "micros") for row in others), default=np.nan)
    return [
        arm,
        f"{rate:g}",
        f"{sum(led)} of {len(led)}",
        f"{len(own) - len(lost)} of {len(own)}",
        f"{len(own) - len(behind(rows, list(own), within_bounds=True))}",
        f"{len(own) - len(behind(rows, list(own), 'weighed'))}",
        ", ".join(lost),
        *(
            f"{total(own, what)} : {', '.join(str(total(row, what)) for row in others)}"
            for what in ("freezes", "violations")
        ),
        f"{one:.3g} : {loop:.3g} : {theirs:.3g}",
        f"{theirs / one:.3g} : {theirs / loop:.3g}",
    ]


def run(name: str, rate: float, seeds: int, ticks: int, python: str | None) -> dict[str, dict[str, Row]]:
    """Return all rows of one arm at one rate by method and stream."""
    arm = aa.Arm.from_catalogue(name)
    start = streams.posture(arm)
    hands = {
        f"{scenario}-{seed}": streams.stream(
            arm, scenario, seed, dt=1 / rate, seconds=min(SECONDS, ticks / rate)
        )
        for scenario in streams.SCENARIOS
        for seed in range(seeds)
    }
    rows = {OURS: {key: ours(arm, hand, start) for key, hand in hands.items()}}
    if python:
        found = peers(python, "mink", arm, hands, start) | peers(python, "pink", arm, hands, start)
        rows |= dict(sorted(found.items()))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--peers", metavar="PYTHON")
    parser.add_argument("--arms", nargs="+", default=ARMS)
    parser.add_argument("--rates", type=float, nargs="+", default=[250.0, 90.0, 1000.0])
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--ticks", type=int, default=4000, help="the most of a hand")
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    given = parser.parse_args()
    parts = [f"{machine.describe()}."]
    lines: list[list[str]] = []
    for rate in given.rates:
        for arm in given.arms:
            rows = run(arm, rate, given.seeds, given.ticks, given.peers)
            if not lines:
                parts += [
                    f"{arm}, {rate:g} ticks a second, {given.seeds} hands in each scenario.",
                    table(rows),
                ]
            lines.append(summary(arm, rate, rows))
            print(*lines[-1], sep=" | ", flush=True)
            said = "Theirs are in the order of the table above;\nthe time is that of the fastest of them."
            text = "\n\n".join([*parts, said, report.table(SUMMARY, lines)])
            if given.write:  # each row as it comes: all of them take half an hour
                report.write("tracking", text)
    print(text)


if __name__ == "__main__":
    main()
