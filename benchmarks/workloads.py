"""What is timed through Python: the rows of the goal table, on an iiwa 7."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from support.threads import in_threads

import armangle as aa

Floats = NDArray[np.float64]

INVERSE_BATCH, FEASIBLE_BATCH, FOLLOW_POSES, SINGLE_CALLS = 200_000, 50_000, 20_000, 2_000
# paper, Eq. (37)
PATH_START = np.radians([-5.4101, -26.4986, -48.1542, -61.6500, 152.6198, 114.4466, 8.1812])
PATH_LENGTH = 0.25  # m along the tool's z axis, there and back (paper, section 6.2)
ELBOW_BENT = 0.1  # rad: a stretched arm's pose, rounded to float32, is out of reach
SOLVE_BATCH, NAIVE_POSES = 10_000, 20
NAIVE_GRID = 360  # arm angles in each of the eight branches
LARGEST_STEP = 10.0  # rad: random postures near a singularity may well move more than a loop would allow


@dataclass(frozen=True)
class Workload:
    """``work()`` does ``units`` of something; ``goals`` in yd a unit, by instruction set, "" for any."""

    name: str
    units: int
    work: Callable[[], object]
    goals: dict[str, float]


def arm() -> aa.Arm:
    """Return the arm of all benchmarks."""
    return aa.Arm.from_catalogue("kuka_iiwa7_r800")


def postures(count: int, seed: int = 2018) -> Floats:
    """Return joints (count, 7) uniform within the limits: their poses are random and feasible."""
    robot = arm()
    return np.random.default_rng(seed).uniform(robot.lower, robot.upper, (count, 7))


def path_poses(count: int) -> tuple[Floats, Floats]:
    """Return the start of the paper's example and poses (count, 4, 4) along its line, there and back."""
    pose, _, _ = arm().forward(PATH_START)
    share = 1.0 - np.abs(np.linspace(-1.0, 1.0, count))
    poses = np.repeat(pose[None], count, axis=0)
    poses[:, :3, 3] += PATH_LENGTH * share[:, None] * pose[:3, 2]
    return PATH_START.copy(), poses


def batches(threads: int = 1) -> list[Workload]:
    """Return the two batch rows."""
    robot = arm()
    q = postures(INVERSE_BATCH)
    pose, psi, gc = robot.forward(q)
    few, few_gc = pose[:FEASIBLE_BATCH].copy(), np.asarray(gc)[:FEASIBLE_BATCH].copy()
    return [
        Workload(
            f"inverse, batch of {INVERSE_BATCH:,}", INVERSE_BATCH,
            lambda: in_threads(threads, lambda: robot.inverse(pose, psi, gc, limits=False)),
            {"avx512": 0.25, "avx2": 0.45},
        ),
        Workload(
            f"feasible, batch of {FEASIBLE_BATCH:,}, one GC a pose", FEASIBLE_BATCH,
            lambda: in_threads(threads, lambda: robot.feasible(few, few_gc)), {"": 2.0},
        ),
    ]  # fmt: skip


def batch_into_array() -> Workload:
    """Return the inverse batch that writes into an array of the user's: no page of the result is new."""
    robot = arm()
    pose, psi, gc = robot.forward(postures(INVERSE_BATCH))
    out = np.empty((INVERSE_BATCH, 7))
    return Workload(
        "the same with out=", INVERSE_BATCH, lambda: robot.inverse(pose, psi, gc, out=out, limits=False), {}
    )


def follow() -> Workload:
    """Return the whole path of the paper's example, a full step a pose."""
    robot = arm()
    start, poses = path_poses(FOLLOW_POSES)
    assert aa.follow(robot, poses, start=start).ok, "the path is to be followed to its end"
    return Workload(
        f"follow, {FOLLOW_POSES:,} poses", FOLLOW_POSES,
        lambda: aa.follow(robot, poses, start=start), {"": 3.0},
    )  # fmt: skip


def single_inverses() -> list[Workload]:
    """Return single calls of inverse: with plain float64 arrays, and with what else users hold."""
    robot = arm()
    q = postures(SINGLE_CALLS)
    q[:, 3] = np.where(np.abs(q[:, 3]) < ELBOW_BENT, ELBOW_BENT, q[:, 3])
    pose, psi, gc = robot.forward(q)
    numbers, indices = psi.tolist(), gc.tolist()
    forms = {
        "float64, contiguous": ([p.copy() for p in pose], 8.0),
        "column-major": ([np.asfortranarray(p) for p in pose], 12.0),
        "float32": ([p.astype(np.float32) for p in pose], 12.0),
        "nested lists": ([p.tolist() for p in pose], 12.0),
    }

    def calls(poses: list[object]) -> Callable[[], None]:
        arguments = list(zip(poses, numbers, indices, strict=True))

        def run() -> None:
            inverse = robot.inverse
            for frame, angle, branch in arguments:
                inverse(frame, angle, branch)

        return run

    return [
        Workload(f"one arm.inverse call, {form}", SINGLE_CALLS, calls(poses), {"": goal})
        for form, (poses, goal) in forms.items()
    ]


def single_step() -> Workload:
    """Return single calls of step, each from the posture of its pose."""
    robot = arm()
    q = postures(SINGLE_CALLS)
    arguments = [(joints.copy(), pose.copy()) for joints, pose in zip(q, robot.forward(q)[0], strict=True)]

    def run() -> None:
        step = aa.step
        for joints, pose in arguments:
            step(robot, joints, pose, max_joint_step=LARGEST_STEP)

    return Workload("one aa.step call", SINGLE_CALLS, run, {"": 10.0})


def solving() -> list[Workload]:
    """Return the nearest posture to a seed anywhere: a batch, single calls, and the naive way, a grid."""
    robot = arm()
    q = postures(SOLVE_BATCH)
    pose, near = robot.forward(q)[0], np.roll(q, 1, axis=0)
    arguments = [(p.copy(), seed.copy()) for p, seed in zip(pose[:SINGLE_CALLS], near, strict=False)]
    branches, angles = np.meshgrid(np.arange(8), np.linspace(-np.pi, np.pi, NAIVE_GRID))

    def single() -> None:
        for frame, seed in arguments:
            robot.solve(frame, seed)

    def naive() -> None:
        for frame, seed in arguments[:NAIVE_POSES]:
            found = robot.inverse(frame, angles, branches, seed=seed, limits=False)
            far = np.linalg.norm(found - seed, axis=-1)
            far[~robot.within_limits(found)] = np.inf
            found[np.unravel_index(np.argmin(far), far.shape)]

    return [
        Workload(
            f"solve, batch of {SOLVE_BATCH:,}, a seed anywhere", SOLVE_BATCH,
            lambda: robot.solve(pose, near), {"": 40.0},
        ),
        Workload("one arm.solve call, a seed anywhere", SINGLE_CALLS, single, {"": 80.0}),
        Workload(f"the naive way: a grid of 8 × {NAIVE_GRID} by arm.inverse", NAIVE_POSES, naive, {}),
    ]  # fmt: skip


def other_calls() -> list[Workload]:
    """Return single calls of what is neither inverse, step nor solve."""
    robot = arm()
    q = postures(SINGLE_CALLS)
    pose, _, gc = robot.forward(q)
    arguments = list(zip([p.copy() for p in pose], gc.tolist(), strict=True))

    def forward() -> None:
        for joints in q:
            robot.forward(joints)

    def feasible() -> None:
        for frame, branch in arguments:
            robot.feasible(frame, branch)

    def every_branch() -> None:
        for frame, _ in arguments:
            robot.feasible(frame)

    return [
        Workload("one arm.forward call", SINGLE_CALLS, forward, {"": 8.0}),
        Workload("one arm.feasible call", SINGLE_CALLS, feasible, {"": 25.0}),
        Workload("one arm.feasible call, every gc", SINGLE_CALLS, every_branch, {"": 40.0}),
    ]


def goal_rows() -> list[Workload]:
    """Return every row of the goal table but the two-thread ones."""
    inverse, feasible = batches()
    return [
        inverse, batch_into_array(), feasible, follow(), *single_inverses(), single_step(), *other_calls(),
        *solving(),
    ]  # fmt: skip
