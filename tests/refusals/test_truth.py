"""A result has no truth value: it would be True without a solution."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import armangle as aa
from armangle import _values

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
Q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
POSE, PSI, GC = ARM.forward(Q)
FAR = POSE.copy()
FAR[0, 3] = 2.0
TRACKER = aa.Tracker(ARM)
TRACKER.start(Q)
PATH = aa.follow(ARM, POSE[None], start=Q)
RESULTS: dict[str, Any] = {
    "Solution": ARM.solve(FAR),
    "Solutions": ARM.solutions(FAR),
    "ArcSet": ARM.feasible(FAR, GC),
    "Freedom": ARM.freedom(FAR),
    "Diagnosis": ARM.explain(FAR),
    "Branch": ARM.explain(FAR)[0],
    "Resolution": aa.resolve(ARM, FAR, PSI, GC),
    "Step": aa.step(ARM, Q, FAR),
    "Tracked": TRACKER.step(FAR),
    "JointPath": aa.follow(ARM, FAR[None], start=Q),
    "Trajectory": aa.retime(PATH, acceleration=5.0),
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_has_no_truth_value(name: str) -> None:
    """`bool` of a result raises and names `.ok`, which only the trajectory here has True."""
    result = RESULTS[name]
    assert type(result).__name__ == name
    assert bool(np.all(result.ok)) is (name == "Trajectory")
    with pytest.raises(TypeError, match=rf"^{name} has no truth value: ask \.ok"):
        bool(result)
    with pytest.raises(TypeError, match=rf"^{name} has no truth value"):
        assert not result


def test_a_value_that_is_no_result_keeps_its_truth() -> None:
    """`by_content` leaves `bool` of a class without `ok` alone."""

    @_values.by_content
    class Plain(tuple):
        __slots__ = ()

    assert not Plain()
    assert Plain((1,))
