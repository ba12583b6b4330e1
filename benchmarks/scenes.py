"""Time arcs of obstacles, as multiples of `Arm.feasible` of one branch in the same run.

    python benchmarks/scenes.py [--rounds 9]

Batches of random feasible poses of an iiwa 7, one thread, CPU time; a row is the median of the rounds. The
last rows of arcs are the naive way: a grid of 360 arm angles, `inverse` and `frames` for each, and the
distance of a ball from both bones in NumPy, beside the exact arcs of the same ball; then, where coal is
installed, its distances of 64 balls from both bones on the same grid, one call from Python for each pair.
Then `step` and the certificate of a plan among 64 balls, each beside the same without them.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import workloads

import armangle as aa

POSES, GRID, NAIVE_POSES, CLOUD_POSES, STEPS, PATHS = 5000, 360, 20, 500, 500, 12
BONES = aa.Body.bones(upper_arm=0.09, forearm=0.08)
SPHERES = aa.Body(
    {
        3: [aa.Ball([0.02, -0.4 + 0.05 * k, 0.0], 0.07) for k in range(8)],
        4: [aa.Ball([0.02, 0.0, 0.05 * k], 0.07) for k in range(8)],
    }
)


def obstacles(count: int, kind: str) -> aa.Scene:
    """Return shapes of 2 to 6 cm within 1 m of the shoulder, none nearer than 0.3 m."""
    rng = np.random.default_rng(count)
    shapes = []
    while len(shapes) < count:
        place = rng.uniform(-1, 1, 3)
        if np.linalg.norm(place) < 0.3:
            continue
        place += [0, 0, 0.34]
        if kind == "balls":
            shapes.append(aa.Ball(place, rng.uniform(0.02, 0.06)))
        elif kind == "capsules":
            shapes.append(aa.Capsule(place, place + rng.uniform(-0.2, 0.2, 3), 0.03))
        else:
            frame = aa.pose(place, rpy=rng.uniform(-3, 3, 3))
            shapes.append(aa.Box(frame, rng.uniform(0.02, 0.2, 3)))
    return aa.Scene(shapes)


def room(count: int) -> aa.Scene:
    """Return points on a floor, two walls and a few things about the arm, as a camera sees them."""
    rng = np.random.default_rng(count)
    points = rng.uniform((-2, -2, 0), (2, 2, 4), (count, 3))
    each = np.arange(count) % 10
    points[each < 4, 2] = -0.1
    points[(each >= 4) & (each < 7), 0] = -1.5
    points[(each == 7) | (each == 8), 1] = 1.6
    things = each == 9
    middles = np.array([[0.7, 0.5, 0.3], [0.6, -0.6, 0.2], [-0.3, 0.8, 0.5], [0.9, 0.0, 0.1]])
    around = rng.normal(size=(int(things.sum()), 3))
    around *= 0.12 / np.linalg.norm(around, axis=1)[:, None]
    points[things] = middles[rng.integers(0, len(middles), len(around))] + around
    return aa.Scene([aa.Cloud(points, 0.005)])


def naive(arm: aa.Arm, pose: workloads.Floats, gc: int, ball: aa.Ball) -> np.ndarray:
    """Return which of 360 arm angles keep the ball off both bones."""
    psi = np.linspace(-np.pi, np.pi, GRID, endpoint=False)
    at = arm.frames(arm.inverse(pose, psi, gc, limits=False))[:, :, :3, 3]
    free = np.ones(GRID, dtype=bool)
    for begin, end, radius in ((at[:, 1], at[:, 3], 0.09), (at[:, 3], at[:, 5], 0.08)):
        along = end - begin
        share = np.sum((ball.center - begin) * along, axis=1) / np.sum(along * along, axis=1)
        near = begin + np.clip(share, 0, 1)[:, None] * along
        free &= np.linalg.norm(near - ball.center, axis=1) >= radius + ball.radius
    return free


def coal_grid(
    arm: aa.Arm, pose: workloads.Floats, gc: int, balls: aa.Scene, coal: Any
) -> Callable[[], np.ndarray]:
    """Return the least distance of balls from both bones at 360 arm angles, by coal; its shapes made once."""
    psi = np.linspace(-np.pi, np.pi, GRID, endpoint=False)
    spheres = [
        (coal.Sphere(ball.radius), coal.Transform3s(np.eye(3), np.asarray(ball.center)))
        for ball in balls.shapes
    ]
    bones = [
        (coal.Capsule(radius, 1e-9 + length), at) for radius, length, at in ((0.09, 0.4, 1), (0.08, 0.4, 3))
    ]
    request, result = coal.DistanceRequest(), coal.DistanceResult()

    def work() -> np.ndarray:
        at = arm.frames(arm.inverse(pose, psi, gc, limits=False))[:, :, :3, 3]
        least = np.full(GRID, np.inf)
        for k in range(GRID):
            for bone, first in bones:
                begin, end = at[k, first], at[k, first + 2]
                along = (end - begin) / np.linalg.norm(end - begin)
                side = np.cross(along, np.eye(3)[np.abs(along).argmin()])
                side /= np.linalg.norm(side)
                turn = np.column_stack([side, np.cross(along, side), along])
                place = coal.Transform3s(turn, 0.5 * (begin + end))
                for sphere, there in spheres:
                    result.clear()
                    least[k] = min(least[k], coal.distance(bone, place, sphere, there, request, result))
        return least

    return work


def nanoseconds(work: Callable[[], object], units: int) -> float:
    """Return CPU time of one unit, ns."""
    start = time.thread_time_ns()
    work()
    return (time.thread_time_ns() - start) / units


def steps(arm: aa.Arm, scene: aa.Scene | None) -> Callable[[], object]:
    """Return steps of half a millimetre from postures that are clear of what stands about."""
    among = obstacles(64, "balls")
    poses, psi, gc = arm.forward(workloads.postures(4 * STEPS))
    free = arm._clear(poses, gc, among).contains(psi)
    q = arm.inverse(poses, psi, gc, seed=workloads.postures(4 * STEPS), limits=False)[free][:STEPS]
    ahead = arm.forward(q)[0]
    ahead[:, 2, 3] += 0.0005
    return lambda: [aa.step(arm.with_(scene=scene), at, to) for at, to in zip(q, ahead, strict=True)]


def certificates(arm: aa.Arm, scene: aa.Scene) -> list[tuple[Callable[[], object], Callable[[], object]]]:
    """Return the proofs of some plans: of their limits alone, and of their limits among the obstacles."""
    proofs = []
    rng = np.random.default_rng(15)
    for pose in arm.forward(workloads.postures(40 * PATHS))[0]:
        there = pose.copy()
        there[:3, 3] += rng.normal(size=3) * 0.06
        path = aa.plan(arm.with_(scene=scene), aa.Line(pose, there))
        if not path.certified:
            continue
        made: Any = path.curve
        curve, handle = (made.segments, made.stretches, made.plane, made.gc, 0.0), arm._needed(scene).handle
        proofs.append(
            (
                lambda c=curve: arm._handle.certify_curve(*c),
                lambda c=curve, h=handle: arm._handle.certify_curve(*c, h),
            )
        )
        if len(proofs) == PATHS:
            break
    return proofs


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--rounds", type=int, default=9)
    rounds = parser.parse_args().rounds
    arm = workloads.arm()
    pose, _, gc = arm.forward(workloads.postures(POSES))
    rows: list[tuple[str, Callable[[], object], int]] = [("feasible", lambda: arm.feasible(pose, gc), POSES)]
    for name, body in (("2 bones", BONES), ("16 spheres", SPHERES)):
        for kind, counts in (("balls", (8, 64, 1024)), ("capsules", (8,)), ("boxes", (8,))):
            for count in counts:
                robot, scene = arm.with_(body=body), obstacles(count, kind)
                rows.append(
                    (f"{name} x {count} {kind}", lambda r=robot, s=scene: r._clear(pose, gc, s), POSES)
                )
    for name, body in (("2 bones", BONES), ("16 spheres", SPHERES)):
        for count in (10_000, 100_000, 1_000_000):
            robot, scene = arm.with_(body=body), room(count)
            few_poses, few_gc = pose[:CLOUD_POSES], gc[:CLOUD_POSES]
            robot._clear(few_poses[0], 0, scene)  # sorts the points once
            rows.append(
                (
                    f"{name} x cloud of {count}",
                    lambda r=robot, s=scene, p=few_poses, g=few_gc: r._clear(p, g, s),
                    CLOUD_POSES,
                )
            )
    robot, ball = arm.with_(body=BONES), obstacles(1, "balls")
    rows.append(("one ball, exact", lambda: robot._clear(pose, gc, ball), POSES))
    few = range(NAIVE_POSES)

    def grid() -> object:
        return [naive(arm, pose[i], int(gc[i]), ball.shapes[0]) for i in few]

    rows.append((f"one ball, grid of {GRID}", grid, NAIVE_POSES))
    times = np.median([[nanoseconds(work, n) for _, work, n in rows] for _ in range(rounds)], axis=0)
    for (name, _, _), ns in zip(rows, times, strict=True):
        print(f"{name:28} {ns:10.0f} ns  {ns / times[0]:8.2f} x feasible")
    print(f"grid / exact: {times[-1] / times[-2]:.0f}")
    among = obstacles(64, "balls")
    try:
        import coal
    except ImportError:
        print("coal is not installed: its grid is left out")
    else:
        one = nanoseconds(coal_grid(arm, pose[0], int(gc[0]), among, coal), 1)
        exact = next(ns for (name, _, _), ns in zip(rows, times, strict=True) if name == "2 bones x 64 balls")
        print(f"2 bones x 64 balls, coal on a grid of {GRID}: {one / 1e6:.0f} ms, exact x {one / exact:.0f}")
    for name, body in (("2 bones", BONES), ("16 spheres", SPHERES)):
        robot = arm.with_(body=body)
        beside(f"step, {name}", [(steps(robot, None), steps(robot, among))], STEPS, rounds)
        beside(f"certificate of a plan, {name}", certificates(robot, among), 1, rounds)


def beside(
    name: str, pairs: list[tuple[Callable[[], object], Callable[[], object]]], units: int, rounds: int
) -> None:
    """Print what 64 balls cost: the sum of the second of each pair over that of the first."""
    free, among = np.median(
        [
            [sum(nanoseconds(pair[k], units) for pair in pairs) / len(pairs) for k in (0, 1)]
            for _ in range(rounds)
        ],
        axis=0,
    )
    print(f"{name:34} {free / 1e3:9.1f} us, among 64 balls {among / 1e3:9.1f} us: {among / free:5.2f} x")


if __name__ == "__main__":
    main()
