"""Run `armangle.Tracker` beside mink and pink: the same hands, the same bounds, the same hand filter.

    python benchmarks/tracking.py [--peers PYTHON] [--arm NAME] [--seeds 8] [--seconds 10] [--dt 0.004]
                                  [--write]

PYTHON is an interpreter with ``pip install mink pin-pink daqp``. Per stream: RMS distance of the tool from
the hand without noise, over the ticks at which the hand has been in reach for 0.5 s; ticks that break a bound
on speed, acceleration or position (1e-6 relative); freezes (0.5 s without motion, more than 20 mm from a hand
in reach); programmes without solution; time of a tick, one call each, the median of each stream and of the
streams, and CPU time in one call of `run`. A stream is ahead if its RMS distance is less than that of the
best of the others on it.
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
from support import streams  # noqa: E402  # the same hands as the tests'

Floats = NDArray[np.float64]

ACCELERATION = 10.0
LENGTH = 0.2  # m that a radian counts as: the tracker's own, and that of adapters/track_worker.py
SLACK = 1e-6
FROZEN, FAR, STILL = 0.5, 0.02, 1e-6  # s, m, rad/s
OURS = "armangle"
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
    q, times = np.empty((len(stream.samples), 7)), np.empty(len(stream.samples))
    for i, pose in enumerate(stream.samples):
        before = time.perf_counter()
        now = tracker.step(pose)
        times[i] = time.perf_counter() - before
        q[i] = now.q
    row = judge(arm, stream, start, q, 0, float(np.median(times)) * 1e6)
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
        result = {what: found[f"{name}|{key}|{what}"] for what in ("q", "times", "failed")}
        micros = float(np.median(result["times"])) * 1e6
        rows.setdefault(name, {})[key] = judge(
            arm, given[key], start, result["q"], int(result["failed"]), micros
        )
    return rows


def ahead(rows: dict[str, dict[str, Row]], keys: list[str], what: str) -> int:
    """Return in how many streams ours is less than the best of the others."""
    others = [rows[name] for name in rows if name != OURS]
    return sum(
        getattr(rows[OURS][key], what) < min(getattr(row[key], what) for row in others) for key in keys
    )


def table(rows: dict[str, dict[str, Row]], seeds: int) -> str:
    """Return the table in Markdown, the best RMS error of each scenario in bold, and the goals."""
    names = [OURS, *sorted(set(rows) - {OURS})]
    beside = len(names) > 1
    lines = []
    means = 0
    for scenario in streams.SCENARIOS:
        keys = [f"{scenario}-{seed}" for seed in range(seeds)]
        mean, tail, turn = (
            {name: np.mean([getattr(rows[name][key], what) for key in keys]) for name in names}
            for what in ("rms", "p99", "turn")
        )
        best = min(mean, key=lambda name: mean[name])
        means += best == OURS
        cells = [f"{mean[n]:.3g} / {tail[n]:.3g} / {turn[n]:.3g}" for n in names]
        cells = [f"**{cell}**" if n == best else cell for n, cell in zip(names, cells, strict=True)]
        lines.append([scenario, *cells, f"{ahead(rows, keys, 'rms')} of {seeds}" if beside else ""])
    for what, label in (
        ("violations", "ticks that break a bound"),
        ("freezes", "freezes"),
        ("failed", "no solution"),
    ):
        lines.append([label, *(str(sum(getattr(row, what) for row in rows[n].values())) for n in names), ""])
    micros = {n: float(np.median([row.micros for row in rows[n].values()])) for n in names}
    lines.append(["µs a tick, one call each", *(f"{micros[n]:.3g}" for n in names), ""])
    loop = float(np.median([row.loop for row in rows[OURS].values() if row.loop]))
    lines.append(["µs a tick, all in one `run`", f"{loop:.3g}", *([""] * len(names))])
    text = report.table(["RMS mm / 99 % mm / RMS degrees", *names, "streams ahead"], lines)
    if not beside:
        return text
    keys = list(rows[OURS])
    fastest = min(micros[n] for n in names[1:])
    return (
        f"{text}\n\nAhead of the best of them in {means} of {len(streams.SCENARIOS)} means (goal: all) and "
        f"{ahead(rows, keys, 'rms')} of {len(keys)} streams (goal: 45 of 48),\n"
        f"{ahead(rows, keys, 'weighed')} where a radian counts as {LENGTH:g} m, as in what all weigh;\n"
        f"{fastest / micros[OURS]:.3g} times less time than the faster of them one call each, "
        f"{fastest / loop:.3g} times in one `run` (goal: 20)."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--peers", metavar="PYTHON")
    parser.add_argument("--only", default="mink,pink")
    parser.add_argument("--arm", default="kuka_iiwa14_r820")
    parser.add_argument("--seeds", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--dt", type=float, default=0.004)
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    given = parser.parse_args()
    arm = aa.Arm.from_catalogue(given.arm)
    start = streams.posture(arm)
    hands = {
        f"{scenario}-{seed}": streams.stream(arm, scenario, seed, dt=given.dt, seconds=given.seconds)
        for scenario in streams.SCENARIOS
        for seed in range(given.seeds)
    }
    rows = {OURS: {key: ours(arm, hand, start) for key, hand in hands.items()}}
    if given.peers:
        for module in given.only.split(","):
            rows |= peers(given.peers, module, arm, hands, start)
    hand = f"{given.arm}, {given.seeds} hands of {given.seconds:g} s in each scenario, dt = {given.dt:g} s."
    text = f"{machine.describe()}.\n{hand}\n\n{table(rows, given.seeds)}"
    print(text)
    if given.write:
        report.write("tracking", text)


if __name__ == "__main__":
    main()
