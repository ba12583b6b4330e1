"""Measure the numerical error, for docs/background/benchmarks.md: tools/accuracy.py [--count N] [--write].

Random postures within the limits, and families of postures at and beside every singularity. The bulk is
judged by the library against itself (pose of the joints found, against the pose asked for); a sample of each
family is judged by 50-digit arithmetic (mpmath) that shares nothing with the library but the definitions.
"""

from __future__ import annotations

import argparse
import datetime
import platform
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
from accuracy_reference import chain_error, psi_error
from numpy.typing import NDArray

import armangle as aa

Floats = NDArray[np.float64]
Error = dict[str, Floats]

PAGE = Path(__file__).resolve().parents[1] / "docs" / "background" / "benchmarks.md"
OPENING, CLOSING = "<!-- accuracy -->\n", "<!-- /accuracy -->\n"
BLOCK = 200_000
ROBOT = "kuka_iiwa7_r800"
NEAR = (0.0, 1e-12, 1e-9, 1e-6, 1e-3)
BINS = np.logspace(-19, 1, 2001)


def random_joints(arm: aa.Arm, rng: np.random.Generator, n: int) -> Floats:
    return rng.uniform(arm.lower, arm.upper, (n, 7))


def singular(joints: dict[int, float]) -> Callable[[aa.Arm, np.random.Generator, int], Floats]:
    """Return a family of postures whose joints (1..7) lie within NEAR of the values given."""

    def family(arm: aa.Arm, rng: np.random.Generator, n: int) -> Floats:
        q = random_joints(arm, rng, n)
        for joint, value in joints.items():
            q[:, joint - 1] = value + rng.choice(NEAR, n) * rng.choice([-1.0, 1.0], n)
        return q

    return family


FAMILIES: dict[str, Callable[[aa.Arm, np.random.Generator, int], Floats]] = {
    "random within the limits": random_joints,
    "shoulder, θ2 near 0": singular({2: 0.0}),
    "wrist, θ6 near 0": singular({6: 0.0}),
    "elbow, θ4 near 0 (stretched)": singular({4: 0.0}),
    "shoulder and wrist": singular({2: 0.0, 6: 0.0}),
    "shoulder, θ3 near 90°": singular({2: 0.0, 3: np.pi / 2}),
    "wrist, θ5 near 90°": singular({6: 0.0, 5: np.pi / 2}),
    "candle: θ2, θ4, θ6 near 0": singular({2: 0.0, 4: 0.0, 6: 0.0}),
}


class Spread:
    """Maximum and quantiles of many numbers in bounded memory."""

    def __init__(self) -> None:
        self.most = 0.0
        self.counts = np.zeros(len(BINS) + 1, dtype=np.int64)

    def add(self, values: Floats) -> None:
        values = np.abs(values).ravel()
        if not np.isfinite(values).all():
            raise SystemExit("a value is not finite: this is a fault of the library")
        self.most = max(self.most, float(values.max(initial=0.0)))
        self.counts += np.bincount(np.searchsorted(BINS, values), minlength=len(self.counts))

    def quantile(self, share: float) -> float:
        """Return the upper edge of the bin (2.3 % wide) that holds the quantile."""
        at = int(np.searchsorted(np.cumsum(self.counts), share * self.counts.sum()))
        return min(float(BINS[min(at, len(BINS) - 1)]), self.most)

    def text(self) -> str:
        return f"{self.most:.1e} | {self.quantile(0.999):.1e}"


def measure(arm: aa.Arm, q: Floats) -> Error:
    """Return the errors of going to the pose and back, of each posture."""
    pose, psi, gc = arm.forward(q)
    found = arm.inverse(pose, psi, gc, seed=q, limits=False)
    again, psi_again, gc_again = arm.forward(found)
    apart = np.abs(np.remainder(psi_again - psi + np.pi, 2 * np.pi) - np.pi)
    return {
        "position (m)": np.linalg.norm(again[..., :3, 3] - pose[..., :3, 3], axis=-1),
        "rotation (rad)": np.linalg.norm((again - pose)[..., :3, :3], axis=(-2, -1)),
        "ψ (rad)": apart[gc_again == gc],
        "q (rad)": np.abs(found - q).max(axis=-1),
    }


def arc_ends(arm: aa.Arm, q: Floats) -> Floats:
    """Return how far each joint is from the limit that an end of its arcs names, rad."""
    pose, _, gc = arm.forward(q)
    arcs = arm.feasible(pose, gc)
    out = []
    for k, (pairs, ends) in enumerate(zip(arcs.intervals, arcs.ends, strict=True)):
        for psi, end in zip(pairs.ravel(), [e for pair in ends for e in pair], strict=False):
            if end.side in ("lower", "upper"):
                value = arm.inverse(pose[k], psi, gc[k], limits=False)[end.joint - 1]
                out.append(abs(np.remainder(value - end.value + np.pi, 2 * np.pi) - np.pi))
    return np.array(out)


def blocks(total: int) -> Iterator[int]:
    for begin in range(0, total, BLOCK):
        yield min(BLOCK, total - begin)


def report(count: int, sample: int) -> str:
    """Return the section of the page."""
    arm = aa.Arm.from_catalogue(ROBOT)
    rng = np.random.default_rng(2018)
    bulk, judged = [], []
    for name, family in FAMILIES.items():
        total = count if family is random_joints else max(count // 100, BLOCK // 10)
        spread: dict[str, Spread] = {}
        for n in blocks(total):
            for what, values in measure(arm, family(arm, rng, n)).items():
                spread.setdefault(what, Spread()).add(values)
        ends = Spread()
        ends.add(arc_ends(arm, family(arm, rng, 20 * sample)))
        spread["interval end (rad)"] = ends
        bulk.append(f"| {name} | {total:.0e} | " + " | ".join(s.text() for s in spread.values()) + " |")
        q = family(arm, rng, sample)
        pose, psi, _ = arm.forward(q)
        chain = Spread()
        chain.add(np.array([chain_error(arm, each, at) for each, at in zip(q, pose, strict=True)]))
        angle = Spread()
        angle.add(np.array([psi_error(arm, at, each, a) for at, each, a in zip(pose, q, psi, strict=True)]))
        judged.append(f"| {name} | {sample} | {chain.text()} | {angle.text()} |")
        print(bulk[-1], judged[-1], sep="\n", flush=True)
    heads = list(spread)
    return SECTION.format(
        command=f"python tools/accuracy.py --count {count} --sample {sample} --write",
        machine=f"{platform.machine()},\n{platform.system()}, instruction set {aa.ISA}",
        date=datetime.date.today().isoformat(),
        version=aa.__version__,
        heads=" | ".join(f"{h}: max | p99.9" for h in heads),
        rule=" | ".join("--: | --:" for _ in heads),
        bulk="\n".join(bulk),
        judged="\n".join(judged),
    )


SECTION = """Written by `{command}` on {date}, armangle {version}, {machine}.
The arm is a KUKA LBR iiwa 7 R800; all numbers are absolute, and p99.9 is rounded up by at most 2.3 %.

The first table converts configurations to (pose, ψ, gc), back to joints, and to the pose again.
Families "near" a value hold configurations exactly at it and 1e-12, 1e-9, 1e-6 and 1e-3 rad away.
The *pose* holds everywhere.
*q* cannot hold at a singular configuration: there only θ1 + θ3 or θ5 + θ7 is defined, or an angle is the root
of a small number (θ4 of the stretched arm: about 1e-8).
ψ is compared if the branch is the same.
*Interval end*: the distance of the joint from the limit that the end of a feasible interval names.
If dq/dψ is large, it is the rounding of ψ times that slope.

| configurations | number | {heads} |
| :-- | --: | {rule} |
{bulk}

The second table judges the same families by 50-digit arithmetic (mpmath).
*Pose* is the largest error of an entry of the forward kinematics (m or 1).
*ψ* is computed from the rounded pose that the library returned.
If the wrist is near the base axis, or the arm is stretched, the rounding of that pose alone moves ψ.

| configurations | number | pose: max | p99.9 | ψ (rad): max | p99.9 |
| :-- | --: | --: | --: | --: | --: |
{judged}
"""


def with_section(page: str, section: str) -> str:
    """Return the page with a new text between its two markers.

    Raises
    ------
    ValueError
        If the page lacks the markers.
    """
    before, opening, rest = page.partition(OPENING)
    _, closing, after = rest.partition(CLOSING)
    if not opening or not closing:
        raise ValueError(f"{PAGE} has no markers {OPENING.strip()} and {CLOSING.strip()}")
    return f"{before}{opening}{section}{closing}{after}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=10_000_000, help="random postures (families: 1/100)")
    parser.add_argument("--sample", type=int, default=300, help="postures a family judged by mpmath")
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    args = parser.parse_args()
    section = report(args.count, args.sample)
    if args.write:
        PAGE.write_text(with_section(PAGE.read_text(encoding="utf-8"), section), encoding="utf-8")


if __name__ == "__main__":
    main()
