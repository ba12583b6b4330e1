"""Follow streams of poses with mink or pink: ``python -m adapters.track_worker STREAMS.npz URDF OUT.npz``.

Differential inverse kinematics, one quadratic programme a tick, with the peer's own speed and position
limits. Accelerations: mink has no limit of them, so that its speeds go through a limiter (no joint changes
its speed by more than the bound, each can brake before its limit); pink has a limit of its own. Where a
programme has no solution the arm stands still, which the bounds of the row then show.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Tick = Callable[[Floats, Floats, Floats], Floats | None]

LENGTH, POSTURE, DAMPING = 0.2, 1e-2, 1e-3
MASSES = '<mujoco><compiler boundmass="1" boundinertia="0.01" fusestatic="false"/></mujoco>'


def limited(v: Floats, before: Floats, q: Floats, box: dict[str, Floats], dt: float) -> Floats:
    """Return speeds drawn in so that joints keep the acceleration and can brake."""
    a = box["acceleration"]

    def fastest(room: Floats) -> Floats:
        room = np.maximum(room, 0.0)
        return np.asarray(2 * room / (dt + np.sqrt(dt * dt + 2 * room / a)))

    v = np.clip(v, before - a * dt, before + a * dt)
    return np.clip(v, -fastest(q - box["lower"]), fastest(box["upper"] - q))


def mink_rows(urdf: Path, start: Floats, box: dict[str, Floats], dt: float) -> dict[str, Tick]:
    import mink
    import mujoco

    text = urdf.read_text(encoding="utf-8").replace("<link", MASSES + "<link", 1)
    model = mujoco.MjModel.from_xml_string(text)
    names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j) for j in range(7)]
    limits = [
        mink.ConfigurationLimit(model),
        mink.VelocityLimit(model, dict(zip(names, box["velocity"], strict=True))),
    ]

    def row(gain: float) -> Tick:
        configuration = mink.Configuration(model)
        task = mink.FrameTask("tip", "body", 1.0, LENGTH, gain=gain, lm_damping=DAMPING)
        posture = mink.PostureTask(model, cost=POSTURE)
        posture.set_target(start)

        def tick(q: Floats, before: Floats, pose: Floats) -> Floats | None:
            configuration.update(q)
            task.set_target(mink.SE3.from_matrix(pose))
            try:
                v = mink.solve_ik(configuration, [task, posture], dt, "daqp", limits=limits)
            except mink.NoSolutionFound:
                return None
            return limited(v, before, q, box, dt)

        return tick

    return {f"mink, limiter, gain {gain:g}": row(gain) for gain in (1.0, 0.2)}


def pink_rows(urdf: Path, start: Floats, box: dict[str, Floats], dt: float) -> dict[str, Tick]:
    import pink
    import pinocchio as pin
    from pink.limits import AccelerationLimit, ConfigurationLimit, VelocityLimit

    model = pin.buildModelFromUrdf(str(urdf))
    model.velocityLimit = box["velocity"].copy()
    data = model.createData()

    def row(gain: float) -> Tick:
        acceleration = AccelerationLimit(model, box["acceleration"])
        limits = [ConfigurationLimit(model), VelocityLimit(model), acceleration]
        task = pink.FrameTask("tip", 1.0, LENGTH, lm_damping=DAMPING, gain=gain)
        posture = pink.PostureTask(cost=POSTURE)
        posture.set_target(start)

        def tick(q: Floats, before: Floats, pose: Floats) -> Floats | None:
            configuration = pink.Configuration(model, data, q.copy())
            task.set_target(pin.SE3(pose))
            acceleration.set_last_integration(before, dt)
            try:
                v = pink.solve_ik(
                    configuration, [task, posture], dt, "daqp", limits=limits, safety_break=False
                )
            except (pink.exceptions.PinkError, ValueError):
                return None
            return np.asarray(v) if v is not None and np.isfinite(v).all() else None

        return tick

    return {f"pink, acceleration limit, gain {gain:g}": row(gain) for gain in (1.0, 0.2)}


def follow(tick: Tick, poses: Floats, start: Floats, dt: float) -> tuple[Floats, float, int]:
    """Return joints (n, 7), CPU time of a tick in s, and how many programmes had no solution."""
    q, v, failed = start.copy(), np.zeros(7), 0
    out = np.empty((len(poses), 7))
    before = time.thread_time()
    for i, pose in enumerate(poses):
        wanted = tick(q, v, pose)
        failed += wanted is None
        v = np.zeros(7) if wanted is None else wanted
        q = q + v * dt
        out[i] = q
    return out, (time.thread_time() - before) / len(poses), failed


def main() -> None:
    module, streams, urdf, out = sys.argv[1:5]
    given = dict(np.load(streams))
    box = {name: given.pop(name) for name in ("lower", "upper", "velocity", "acceleration")}
    start, dt = given.pop("start"), float(given.pop("dt"))
    make = {"mink": mink_rows, "pink": pink_rows}[module]
    results: dict[str, Any] = {}
    for key, poses in given.items():
        for name, tick in make(Path(urdf), start, box, dt).items():
            q, seconds, failed = follow(tick, poses, start, dt)
            results[f"{name}|{key}|q"] = q
            results[f"{name}|{key}|seconds"] = np.array(seconds)
            results[f"{name}|{key}|failed"] = np.array(failed)
    np.savez(out, **results)


if __name__ == "__main__":
    main()
