"""Of one pose, posture or value, every number returned is a NumPy scalar, never an array without axes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

import armangle as aa

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POSE, PSI, GC = ARM.forward(Q)
BONY = ARM.with_(body=aa.Body.bones(upper_arm=0.09, forearm=0.08))
SCENE = aa.Scene([aa.Ball([0.4, 0.2, 0.4], 0.05, name="lamp")])
LINE = aa.Line(POSE, POSE @ aa.pose([0, 0, 0.1]))
OFFSET = aa.Arm.from_catalogue("franka_fr3")
OFFSET_Q = np.array([0, 0.1, 0, -1.5, 0, 1.6, 0.7])
TRACKER = aa.Tracker(ARM)
TRACKER.start(Q)
PLAN = aa.plan(ARM, LINE, start=Q)
TIMED = aa.retime(PLAN, acceleration=5.0)
RESULTS = {
    "forward": (POSE, PSI, GC),
    "solve": ARM.solve(POSE, seed=Q),
    "solutions": ARM.solutions(POSE, seed=Q),
    "farthest from limits": ARM.solve(POSE, prefer="margin"),
    "feasible": ARM.feasible(POSE, GC),
    "gradients.feasible": aa.gradients.feasible(ARM, POSE, GC),
    "gradients.joint_function": aa.gradients.joint_function(ARM, POSE, GC, 3),
    "freedom": ARM.freedom(POSE),
    "reachable": ARM.reachable(POSE),
    "feasible_turns": ARM.feasible_turns(POSE, about="base"),
    "within_limits": ARM.within_limits(Q),
    "psi_towards": ARM.psi_towards(POSE, GC, direction="up"),
    "clearance": BONY.clearance(Q, SCENE),
    "farthest from obstacles": BONY.with_(scene=SCENE).solve(POSE, prefer="clearance"),
    "explain": ARM.explain(POSE),
    "step": aa.step(ARM, Q, POSE),
    "resolve": aa.resolve(ARM, POSE, PSI, GC),
    "tracked": TRACKER.step(POSE),
    "plan": PLAN,
    "at": PLAN.at(0.3),
    "retime": TIMED,
    "moment": TIMED.at(0.1),
    "gc_signs": aa.gc_signs(GC),
    "gc_index": aa.gc_index([1, -1, 1]),
    "place": aa.place(ARM, POSE[None], np.linspace(-0.1, 0.1, 3), np.linspace(-0.1, 0.1, 3)),
    "to_e1": aa.kuka.to_e1(ARM, Q),
    "status": aa.kuka.status(ARM, Q),
    "turn": aa.kuka.turn(ARM, Q),
    "to_frame": aa.kuka.to_frame(ARM, Q),
    "offset forward": OFFSET.forward(OFFSET_Q),
    "offset solve": OFFSET.solve(OFFSET.forward(OFFSET_Q)[0], seed=OFFSET_Q),
    "offset freedom": OFFSET.freedom(OFFSET.forward(OFFSET_Q)[0]),
}


def arrays_without_axes(name: str, value: object, depth: int = 0) -> Iterator[str]:
    """Yield the name of each array of no axes in a result and its members, three levels deep."""
    if isinstance(value, np.ndarray):
        if value.ndim == 0:
            yield name
        return
    if depth > 3 or value is None or isinstance(value, str | int | float | np.generic | type):
        return
    if type(value) is tuple:
        for i, item in enumerate(value):
            yield from arrays_without_axes(f"{name}[{i}]", item, depth + 1)
        return
    for member in (m for m in dir(value) if not m.startswith("_")):
        item = getattr(value, member)
        if not callable(item):
            yield from arrays_without_axes(f"{name}.{member}", item, depth + 1)


@pytest.mark.parametrize("name", RESULTS)
def test_one_result_holds_scalars(name: str) -> None:
    """A result for one pose holds no array without axes."""
    assert list(arrays_without_axes(name, RESULTS[name])) == []
