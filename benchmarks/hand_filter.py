"""Show how `HandFilter.omega` trades noise for lag, by how often a hand is seen.

    python benchmarks/hand_filter.py [--arm NAME] [--omega 20 40 80 160] [--seconds 20] [--write]

A tracker at 1 kHz follows a hand that is seen 90, 250 or 1000 times a second. *Shakes*: what noise of 0.4 mm
and 0.08 degrees a sample makes of a hand that stands: RMS of the tool's distance from it, and of the joints'
accelerations. *Behind*: RMS of the tool's distance from a hand without noise that swings by 5 cm once a
second. *Both*: the same with noise.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import machine
import numpy as np
import report
from numpy.typing import NDArray

import armangle as aa

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from support import streams

Floats = NDArray[np.float64]

DT = 1e-3  # s
RATES = (90.0, 250.0, 1000.0)  # 1/s
SWING = 0.05  # m, once a second
BEGINNING = 2.0  # s that do not count


def swinging(home: Floats, seconds: float, by: float) -> Floats:
    """Return where a hand is that begins to swing smoothly, poses (n, 4, 4)."""
    t = DT * np.arange(round(seconds / DT))
    poses = np.repeat(home[None], len(t), axis=0)
    poses[:, 1, 3] += by * np.minimum(t / BEGINNING, 1.0) ** 2 * np.sin(2 * np.pi * t)
    return poses


def seen(true: Floats, rate: float, noise: bool) -> Floats:
    """Return what is told of a hand at every tick by a device that looks `rate` times a second."""
    beat = np.floor(DT * np.arange(len(true)) * rate + 1e-9).astype(int)
    fresh = np.diff(beat, prepend=-1) > 0
    told = streams.noisy(true, np.random.default_rng(1)) if noise else true
    return np.asarray(told[fresh][np.cumsum(fresh) - 1])


def followed(arm: aa.Arm, start: Floats, true: Floats, samples: Floats, omega: float) -> tuple[float, float]:
    """Return RMS of the tool's distance from the hand, mm, and of the joints' accelerations, rad/s^2."""
    tracker = aa.Tracker(arm, DT, filter=aa.HandFilter(omega=omega))
    tracker.start(start)
    q = tracker.run(samples)
    counted = slice(round(BEGINNING / DT), None)
    metres, _ = streams.errors(arm, q[counted], true[counted])
    hard = np.diff(q, 2, axis=0)[counted] / DT**2
    return float(np.sqrt((metres**2).mean())) * 1e3, float(np.sqrt((hard**2).mean()))


def rows(arm: aa.Arm, omegas: list[float], seconds: float) -> list[list[str]]:
    """Return a row for each rate and omega."""
    start = streams.posture(arm)
    home = np.asarray(arm.forward(start)[0])
    still, moving = swinging(home, seconds, 0.0), swinging(home, seconds, SWING)
    out = []
    for rate in RATES:
        for omega in omegas:
            shakes, hard = followed(arm, start, still, seen(still, rate, noise=True), omega)
            behind, _ = followed(arm, start, moving, seen(moving, rate, noise=False), omega)
            both, _ = followed(arm, start, moving, seen(moving, rate, noise=True), omega)
            numbers = (f"{number:.2g}" for number in (shakes, hard, behind, both))
            out.append([f"{rate:g}", f"{omega:g}", *numbers])
    return out


def main() -> None:
    """Print the table, or write it into the README."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--arm", default="kuka_iiwa14_r820")
    parser.add_argument("--omega", type=float, nargs="*", default=[20.0, 40.0, 80.0, 160.0])
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--write", action="store_true", help="put the table into benchmarks/README.md")
    args = parser.parse_args()
    head = ["samples a second", "omega, 1/s", "shakes, mm", "shakes, rad/s²", "behind, mm", "both, mm"]
    lines = rows(aa.Arm.from_catalogue(args.arm), args.omega, args.seconds)
    text = f"{machine.describe()}.\n{args.arm}.\n\n{report.table(head, lines)}"
    print(text)
    if args.write:
        report.write("hand filter", text)


if __name__ == "__main__":
    main()
