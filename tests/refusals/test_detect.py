"""Arms that are not S-R-S: real and made ones, each with its sentence and numbers."""

from __future__ import annotations

import re

import numpy as np
import pytest
from support.chain import broken_chain, dh_forward, pose_error, shift, turn, urdf_forward
from support.chains import read_urdf
from support.needs import model
from support.refused import not_refused

from armangle.errors import InputError, ModelError
from armangle.models.detect import describe_chain

X = np.array([1.0, 0.0, 0.0])

REFUSED = {
    # name: pieces of the message in order, near
    "franka_panda": (["axes 5, 6 and 7 miss a common wrist point by 88 mm",
                      "axes 6 and 7 pass 88 mm apart"], False),
    "ufactory_xarm7": (["axes 5, 6 and 7 miss a common wrist point by 76 mm"], False),
    "rethink_sawyer": (["shoulder point by 192.5 mm", "axes 1 and 2 pass 81 mm apart",
                        "wrist point by 136.3 mm"], False),
    "kinova_gen3_7dof": (["but near it: nothing is off by more than 11.75 mm",
                          "shoulder point by 11.75 mm", "wrist point by 0.3505 mm"], True),
    "kuka_iiwa14_rosi": (["but near it", "shoulder point by 0.4362 mm (axes 1 and 2 pass 0.4362 mm apart)"],
                         True),
}  # fmt: skip


def test_real_files_are_refused_with_their_numbers():
    """`describe_chain` refuses real arms that are not S-R-S with their distances, worst first."""
    for name, (pieces, near) in REFUSED.items():
        with pytest.raises(ModelError, match=name) as caught:
            describe_chain(read_urdf(model(name)))
        message = str(caught.value)
        places = [message.index(piece) for piece in pieces]
        assert places == sorted(places), name
        assert caught.value.near is near and caught.value.reasons[0] in message


@pytest.mark.parametrize(("name", "length"), [("kuka_iiwa14_rosi", 5e-4), ("kinova_gen3_7dof", 13e-3)])
def test_raised_tolerance_takes_a_near_arm_and_says_how_near(name, length):
    """`describe_chain` takes a near arm within a larger tolerance; its residual bounds the error."""
    path = model(name)
    chain = read_urdf(path)
    arm, report = describe_chain(chain, length=length)
    assert 1e-5 < report.residual_position < 4 * length
    assert max(report.shoulder_miss, report.wrist_miss) <= length
    q = np.random.default_rng(2).uniform(-np.pi, np.pi, 7)
    own = urdf_forward(path.read_text(), chain.tip, dict(zip(arm.joint_names, q, strict=True)))
    assert pose_error(dh_forward(arm, q), own)[0] <= report.residual_position


BROKEN = [
    (2, turn(X, 0.1), r"not orthogonal: axes 2 and 3 are 95\.7296 deg"),
    (3, turn(X, 0.1), r"upper arm .* axes 3 and 4 are \S+ deg"),
    (4, turn(X, 0.1), r"forearm .* axes 4 and 5 are \S+ deg"),
    (4, turn(X, np.pi / 2), "axes 4 and 5 are (0|180) deg"),
    (1, shift(0.03, 0, 0), r"shoulder point by 30 mm \(axes 1 and 2 pass 30 mm apart\)"),
    (2, shift(0, 0.002, 0), "axes 1 and 3 meet axis 2 2 mm apart"),
    (6, shift(0.03, 0, 0), "wrist point by 30 mm"),
    (3, shift(0, 0, -0.4), "axis 4 passes through the shoulder point"),
    (5, shift(0, 0, -0.4), "axis 4 passes through the wrist point"),
]  # fmt: skip


def test_each_refusal_has_its_numbers():
    """`describe_chain` refuses chains with one frame moved, with the angle or distance."""
    begins = "(?s)^'broken' \\(a to b\\) is not S-R-S.*"
    assert not_refused(
        (ModelError, begins + numbers, lambda joint=joint,
         frame=frame: describe_chain(broken_chain(joint, frame)))
        for joint, frame, numbers in BROKEN
    ) == []  # fmt: skip


def test_the_reasons_come_first_and_then_each_door_with_its_error():
    """The message of a near arm has the reasons, then what each fit does."""
    with pytest.raises(ModelError) as caught:
        describe_chain(read_urdf(model("kinova_gen3_7dof")))
    said = str(caught.value)
    what, keeps, fitted = said.splitlines()
    near = "is not S-R-S, but near it: nothing is off by more than 11.75 mm"
    assert what.endswith(f"{near}: {'; '.join(caught.value.reasons)}.")
    assert keeps.startswith('fit="own"')
    assert fitted.startswith('fit="srs" with length_tolerance=0.0118') and "up to 15.47 mm" in fitted


def test_reasons_are_ranked_whatever_their_kind():
    """`describe_chain` states the worst reason first, angle or distance."""
    frame = turn(X, 0.2) @ shift(0.001, 0, 0)
    with pytest.raises(ModelError) as caught:
        describe_chain(broken_chain(6, frame))
    assert caught.value.reasons[0].startswith("neighbours are not orthogonal: axes 6 and 7")
    assert not caught.value.near
    with pytest.raises(ModelError) as caught:
        describe_chain(broken_chain(6, shift(0.06, 0, 0) @ turn(X, 1e-4)))
    assert "wrist point by 60" in caught.value.reasons[0]
    assert len(caught.value.reasons) == 2


def test_near_means_at_most_fifty_millimetres():
    """A refused chain is near if nothing is off by more than 50 mm."""
    for millimetre, near in ((0.03, True), (49.0, True), (50.0, True), (51.0, False)):
        with pytest.raises(ModelError) as caught:
            describe_chain(broken_chain(2, shift(0, 1e-3 * millimetre, 0)))
        assert caught.value.near is near and ("but near it" in str(caught.value)) is near


def test_senseless_tolerance_is_refused():
    """`describe_chain` refuses tolerances that are negative, NaN or too large."""
    for kind, value in (("angle", -1.0), ("angle", 1.0), ("length", float("nan")), ("length", 1.0)):
        with pytest.raises(InputError, match=rf"tolerance {kind} is {re.escape(str(value))}"):
            describe_chain(broken_chain(0, np.eye(4)), **{kind: value})
