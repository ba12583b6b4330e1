"""What trackers are given, and what is asked of their ticks."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import armangle as aa

from . import streams
from .calibrated import ARMS as CALIBRATED

Array = NDArray[np.float64]

DT = 0.004
HARDEST = 10.0


def named(name: str) -> aa.Arm:
    """The arm of the catalogue with this name."""
    return aa.Arm.from_catalogue(name)


def settled(tracker: aa.Tracker, pose: Array, seconds: float) -> aa.types.Tracked:
    """The result of the last cycle after tracking one pose for `seconds`."""
    for _ in range(round(seconds / DT)):
        now = tracker.step(pose)
    return now


def random_rotation(rng: np.random.Generator) -> Array:
    """A random rotation matrix."""
    axis = rng.normal(size=3)
    return streams.rotation(rng.uniform(0, np.pi) * axis[None] / np.linalg.norm(axis))[0]


def hostile(arm: aa.Arm, rng: np.random.Generator) -> Array:
    """One target of a random kind: far away, a jump, invalid, and others."""
    pose = np.eye(4)
    kind = rng.integers(6)
    if kind == 0:  # anywhere, in reach or metres away
        pose[:3, :3] = random_rotation(rng)
        pose[:3, 3] = rng.normal(size=3) * rng.choice([0.3, 1.0, 5.0])
    elif kind == 1:  # within limits
        pose = arm.forward(rng.uniform(arm.lower, arm.upper))[0].copy()
    elif kind == 2:  # the wrist in the shoulder
        pose[:3, :3] = random_rotation(rng)
        pose[:3, 3] = [0, 0, arm.geometry.d_bs]
        pose[:3, 3] += pose[:3, 2] * arm.geometry.d_wf
        pose = arm.base @ pose @ arm.tool
    elif kind == 3:
        pose[rng.integers(3), rng.integers(4)] = rng.choice([np.nan, np.inf, 1e300])
    elif kind == 4:  # no rotation
        pose[:3, :3] *= rng.uniform(-2, 2)
    else:  # stretched out along a random ray
        pose[:3, :3] = random_rotation(rng)
        pose[:3, 3] = (arm.geometry.d_se + arm.geometry.d_ew) * rng.normal(size=3)
    return pose


def check_bounds(arm: aa.Arm, q: Array, dt: Array, hardest: float = HARDEST) -> None:
    """Check that joints (n + 1, 7), at rest at first, in cycles dt (n,) stay within limits, the arm's
    velocities and the acceleration `hardest` (rad/s^2), and can brake before limits.
    """
    v = np.diff(q, axis=0) / dt[:, None]
    before = np.concatenate([np.zeros((1, 7)), v[:-1]])
    assert np.isfinite(q).all()
    assert (q >= arm.lower).all()
    assert (q <= arm.upper).all()
    assert (np.abs(v) <= arm.velocity * (1 + 1e-9)).all()
    assert (np.abs(v - before) <= hardest * dt[:, None] * (1 + 1e-9) + 1e-12).all()
    room = np.where(v > 0, arm.upper - q[1:], q[1:] - arm.lower)
    assert (v**2 / (2 * hardest) <= room + 1e-9).all()


ARMS: dict[str, aa.Arm] = {
    "iiwa 14": aa.Arm.from_catalogue("kuka_iiwa14_r820"),
    "RM75": aa.Arm.from_catalogue("realman_rm75_b"),
    "OpenArm": aa.Arm.from_catalogue("openarm_v10"),
    "iiwa 7, 2 mm": CALIBRATED["kuka_iiwa7_r800 2.0 mm"],
    "OpenArm, 1 mm": CALIBRATED["openarm_v10 1.0 mm"],
    "FR3": aa.Arm.from_catalogue("franka_fr3"),
}
"""Of every kind that a tracker leads."""
READY = [0.0, -np.pi / 4, 0.0, -3 * np.pi / 4, 0.0, np.pi / 2, np.pi / 4]


def start_of(arm: aa.Arm) -> Array:
    """The joints at which a run of this arm begins: READY with an offset, otherwise `streams.posture`."""
    return np.array(READY) if arm.kind.startswith("offset") else streams.posture(arm)


def command(arm: aa.Arm, rng: np.random.Generator) -> Array:
    """One target for this arm, of a random kind."""
    if not arm.kind.startswith("offset"):
        return hostile(arm, rng)
    pose = arm.forward(rng.uniform(arm.lower, arm.upper))[0].copy()
    kind = rng.integers(3)
    if kind == 0:
        pose[:3, :3] = random_rotation(rng)
        pose[:3, 3] = rng.normal(size=3) * rng.choice([0.3, 1.0, 5.0])
    elif kind == 1:
        pose[rng.integers(3), rng.integers(4)] = np.nan
    return pose


def differences(q: Array, dt: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Velocity, acceleration and jerk (n, 7) of joints (n + 1, 7) that begin at rest, in cycles dt (n,), then
    the rounding error of each (n, 1).
    """
    step = dt[:, None]
    ulp = np.spacing(np.abs(q).max())
    v = np.diff(q, axis=0) / step
    v_off = 2 * ulp / step
    before = np.concatenate([np.zeros((1, 7)), v[:-1]])
    a = (v - before) / step
    a_off = (v_off + np.concatenate([v_off[:1], v_off[:-1]])) / step
    before = np.concatenate([np.zeros((1, 7)), a[:-1]])
    j = (a - before) / step
    return v, a, j, v_off, a_off, (a_off + np.concatenate([a_off[:1], a_off[:-1]])) / step


def check_jerk(arm: aa.Arm, q: Array, dt: Array, jerk: object, hardest: object = HARDEST) -> None:
    """Check that joints (n + 1, 7), at rest at first, keep limits, the arm's velocities, the acceleration
    `hardest` (rad/s^2) and `jerk` (rad/s^3), each for all joints or (7,).
    """
    v, a, j, v_off, a_off, j_off = differences(q, dt)
    assert np.isfinite(q).all()
    assert (q >= arm.lower).all()
    assert (q <= arm.upper).all()
    assert (np.abs(v) <= arm.velocity * (1 + 1e-12) + v_off).all()
    assert (np.abs(a) <= np.asarray(hardest) * (1 + 1e-12) + a_off).all()
    assert (np.abs(j) <= np.asarray(jerk) * (1 + 1e-12) + j_off).all()
