"""What values look like in words: outcomes, import reports, missing extras, wrong arguments."""

from __future__ import annotations

import dataclasses
import inspect
import json
import pickle
import sys

import numpy as np
import pytest

import armangle as aa
from armangle.arm.numbers import ArmArguments
from armangle.models.description import ArmDescription

LENGTHS = {"d_bs": 0.3, "d_se": 0.4, "d_ew": 0.4, "d_wf": 0.1}


def test_a_status_prints_as_its_name_and_counts_as_its_number() -> None:
    """A Status is its name in text and its number in JSON, arrays and comparisons."""
    for status in aa.Status:
        assert str(status) == f"{status}" == f"{status!s}" == status.name
        assert f"{status:d}" == str(int(status)) and f"{status:>20}" == status.name.rjust(20)
        assert json.dumps(status) == str(int(status)) and pickle.loads(pickle.dumps(status)) is status
        assert np.array([status]).dtype.kind == "i" and status == int(status)
        assert repr(status) == f"<Status.{status.name}: {int(status)}>"


def test_a_status_has_no_truth_value() -> None:
    """`bool` of a Status raises."""
    for status in aa.Status:
        with pytest.raises(TypeError, match=r"\.ok"):
            bool(status)
    assert aa.Status.OK == 0


def test_an_arm_of_the_catalogue_is_shown_by_its_name_and_printed_to_be_read() -> None:
    """The repr of a catalogue arm is its call; str has lengths and limits."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    assert repr(arm) == "Arm.from_catalogue('kuka_iiwa7_r800')"
    other = arm.with_(lower=arm.lower + 0.1)  # of the same name, but not that arm
    assert repr(other).startswith("Arm(d_bs=0.34,") and eval(repr(other), {"Arm": aa.Arm}) == other
    assert str(arm).splitlines() == [
        "kuka_iiwa7_r800: d_bs 340, d_se 400, d_ew 400, d_wf 126 mm, reach 800 mm",
        "limits of joints 1 to 7: -170 to 170, -120 to 120, -170 to 170, -120 to 120, -170 to 170, "
        "-120 to 120, -175 to 175 deg",
    ]
    offset = aa.Arm(**LENGTHS, a_3=0.05)
    assert str(offset).startswith("arm: d_bs 300, d_se 400, d_ew 400, d_wf 100, a_3 50 mm, reach ")
    assert "-inf to inf" in str(offset)


def test_a_solution_is_shown_on_one_line() -> None:
    """The repr of a Solution is one line: its numbers, none, or a count."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    q = [0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]
    pose = arm.forward(q)[0]
    far = pose + np.array([[0, 0, 0, 9.0], [0] * 4, [0] * 4, [0] * 4])
    found = arm.solve(pose, seed=q)
    assert repr(found) == str(found)
    assert repr(found).startswith("Solution(q=[0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5], psi=")
    assert ", gc=2, distance=0, status=OK, margin=" in repr(found)
    assert repr(arm.solve(far)) == "<Solution: none, UNREACHABLE>"
    batch = arm.solve(np.stack([pose, far, pose]))
    assert repr(batch) == "<Solution of a batch (3,): 2 of 3 poses have a solution>"


def test_an_import_report_reads_in_mm_and_degrees() -> None:
    """str of an ImportReport is in mm and degrees."""
    report = aa.types.ImportReport(
        source="arm.urdf", base="link_0", tip="link_7", joint_names=tuple("abcdefg"),
        shoulder_miss=1.5e-6, wrist_miss=0.0, angle_miss=np.radians(0.25),
        residual_position=2e-3, residual_rotation=0.0, postures=10, notes=("mind the gap",),
    )  # fmt: skip
    lines = str(report).splitlines()
    assert lines[:2] == ["arm.urdf: link_0 to link_7", "joints: a, b, c, d, e, f, g"]
    assert " ".join(lines[2].split()) == "three shoulder axes miss a point by 0.001500 mm"
    assert lines[4].endswith(" 0.250000 deg") and lines[5].endswith(" 2.000000 mm")
    assert lines[-1] == "note: mind the gap" and repr(report).startswith("ImportReport(source=")
    arm = aa.Arm.from_urdf(aa.Arm(**LENGTHS).to_urdf())
    assert "position agrees with the file within" in str(arm.report)


@pytest.mark.parametrize(
    ("package", "use", "words"),
    [
        ("matplotlib.pyplot", "plot", "plots need the package matplotlib"),
        ("viser", "view", "the viewer needs the package viser"),
        ("mujoco", "mujoco", "reading MJCF needs the package mujoco"),
    ],
)
def test_a_missing_extra_says_how_to_get_it(
    package: str, use: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Plots, viewer and MJCF without their packages say what to install."""

    from armangle import plots, viewer

    monkeypatch.setitem(sys.modules, package, None)
    arm = aa.Arm(**LENGTHS)
    uses = {
        "plot": lambda: plots.stick_figure(arm, np.zeros(7)),
        "view": lambda: viewer.Viewer(viewer.ViewerState(arm), port=0),
        "mujoco": lambda: aa.Arm.from_mjcf("<mujoco/>"),
    }
    with pytest.raises(aa.MissingExtraError) as raised:
        uses[use]()
    assert str(raised.value) == (
        f"{words}: pip install 'armangle[{use}]' (from a clone: pip install '.[{use}]')"
    )


def test_the_repr_of_a_diagnosis_is_its_sentences() -> None:
    """The repr of a Diagnosis is its `explain()`."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    pose = arm.forward(np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5]))[0]
    far = pose + 2 * np.eye(4, k=3)
    for diagnosis in (arm.explain(pose), arm.explain(far), aa.plan(arm, [pose, far]).diagnosis):
        assert diagnosis is not None
        assert repr(diagnosis) == diagnosis.explain() and "Branch(" not in repr(diagnosis)


def test_no_repr_of_many_rows_floods_the_screen() -> None:
    """Reprs of paths, arcs, joint functions and waypoints have less than 100 characters."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800").with_(velocity=np.ones(7), acceleration=np.ones(7))
    q = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
    pose = arm.forward(q)[0]
    path = aa.plan(arm, aa.Line(pose, pose + 0.05 * np.eye(4, k=3)), start=q)
    arcs = arm.feasible(np.repeat(pose[None], 1000, axis=0), 2)
    for value in (
        path,
        arcs,
        aa.gradients.joint_function(arm, pose, 2, 1),
        path.path and aa.Waypoints(path.poses),
    ):
        assert len(repr(value)) < 100


def test_arguments_of_an_arm_are_named() -> None:
    """`Arm` refuses positional, unknown and missing arguments with a TypeError that names them."""
    with pytest.raises(TypeError, match=r"Arm takes keywords alone, but 4 values .* wanted Arm\(d_bs="):
        aa.Arm(0.3, 0.4, 0.4, 0.1)  # type: ignore[call-arg]  # wrong on purpose
    with pytest.raises(TypeError, match=r"^Arm\(\) got an unexpected keyword argument 'd_sw'"):
        aa.Arm(**LENGTHS, d_sw=1)  # type: ignore[call-arg]  # wrong on purpose
    with pytest.raises(TypeError, match=r"^Arm\(\) missing 1 required keyword-only argument: 'd_wf'"):
        aa.Arm(d_bs=0.3, d_se=0.4, d_ew=0.4)  # type: ignore[call-arg]  # wrong on purpose
    with pytest.raises(TypeError, match=r"missing 2 required keyword-only arguments: 'd_ew', 'd_wf'$"):
        aa.Arm(d_bs=0.3, d_se=0.4)  # type: ignore[call-arg]  # wrong on purpose


def test_what_an_arm_is_made_of_is_listed_once() -> None:
    """The parameters of `Arm` are the fields of ArmDescription, Geometry and ArmArguments."""
    names = {field.name for field in dataclasses.fields(ArmDescription)}
    names |= {"a_1", "a_6", "report", "scene", "singularity_margin"}
    assert set(inspect.signature(aa.Arm).parameters) == names
    assert set(ArmArguments.__annotations__) == names
    own = {name for name in aa.Arm.__annotations__ if not name.startswith("_")} - {"geometry"}
    numbers = {field.name for field in dataclasses.fields(aa.types.Geometry)}
    assert own | numbers - {"reach", "inner_reach", "delta"} == names and not own & numbers


def test_none_stands_for_the_default() -> None:
    """`Arm` takes None for every optional argument."""
    arm = aa.Arm(**LENGTHS)
    optional = [n for n, p in inspect.signature(aa.Arm).parameters.items() if p.default is None]
    assert {"lower", "signs", "tool", "joint_names"} < set(optional)
    assert aa.Arm(**LENGTHS, **dict.fromkeys(optional)) == arm
    assert repr(arm) == "Arm(d_bs=0.3, d_se=0.4, d_ew=0.4, d_wf=0.1)"
