"""Plans of straight lines beside the arm angle simply held: joint travel, reversals, duration.

The lines are random, 0.2 m long, of a KUKA iiwa 7, and such that a held arm angle keeps 6 degrees from every
limit. Ratios are plan / held, medians and worst over the lines, of the default objective; `asked` is of plans
that are asked for a short duration.
"""

from __future__ import annotations

import argparse

import numpy as np

import armangle as aa

LENGTH, ROOM, ROWS = 0.2, np.radians(6.0), 200  # m, rad, rows
ACCELERATION = 5.0  # rad/s^2
HASTE = aa.Objective(duration=100.0, acceleration=ACCELERATION)


def travel(q: np.ndarray) -> float:
    """Return the root of the integral of |dq/ds|^2, rad."""
    return float(np.sqrt((np.diff(q, axis=0) ** 2).sum() * (len(q) - 1)))


def reversals(q: np.ndarray) -> int:
    """Return how often a joint turns back."""
    ways = np.sign(np.round(np.diff(q, axis=0), 9)).T
    return int(sum((np.diff(way[way != 0]) != 0).sum() for way in ways))


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lines", type=int, default=40)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    arm, rng = aa.Arm.from_catalogue("kuka_iiwa7_r800"), np.random.default_rng(args.seed)
    rows: list[tuple[float, int, int, float, float]] = []
    refused = 0
    while len(rows) + refused < args.lines:
        start = rng.uniform(arm.lower * 0.8, arm.upper * 0.8)
        first = arm.forward(start)[0]
        way = rng.normal(size=3)
        last = first.copy()
        last[:3, 3] += LENGTH * way / np.linalg.norm(way)
        line = aa.Line(first, last)
        held = aa.follow(arm, line.pose(np.linspace(0, 1, ROWS)), start=start, policy=aa.Hold())
        if not held.ok or np.nanmin(held.margin) < ROOM:
            continue
        try:
            held_time = aa.retime(held, acceleration=ACCELERATION).duration
        except aa.PathError:  # a curve through the rows held would leave the limits between them
            continue
        planned, hasty = (aa.plan(arm, line, start=start, objective=x) for x in (aa.Objective(), HASTE))
        if not (planned.ok and hasty.ok):
            refused += 1
            continue
        time, asked = (aa.retime(x, acceleration=ACCELERATION).duration / held_time for x in (planned, hasty))
        rows.append(
            (travel(planned.q) / travel(held.q), reversals(planned.q), reversals(held.q), time, asked)
        )
    ratio, turns, turns_held, duration, hastened = np.array(rows).T
    print(f"{len(rows)} lines, {refused} refused")
    print(f"joint travel  {np.median(ratio):.3f}  worst {ratio.max():.3f}")
    print(f"duration      {np.median(duration):.3f}  worst {duration.max():.3f}")
    print(f"   asked      {np.median(hastened):.3f}  worst {hastened.max():.3f}")
    print(f"reversals     {np.median(turns):g} (held {np.median(turns_held):g}), most {turns.max():g}")


if __name__ == "__main__":
    main()
