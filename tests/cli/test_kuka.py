"""``armangle fk --kuka`` and ``armangle ik --kuka``."""

from __future__ import annotations

import json

import numpy as np
import pytest

import armangle as aa
from armangle.cli.main import main

ROBOT = ("--robot", "kuka_iiwa7_r800")
Q = "41.83,36.92,-6.28,-87.49,5.36,55.51,-57.36"
Capture = pytest.CaptureFixture[str]


def test_there_and_back(capsys: Capture) -> None:
    assert main(["fk", *ROBOT, "--kuka", Q]) == 0
    line = next(line for line in capsys.readouterr().out.splitlines() if line.startswith("KUKA"))
    frame = ",".join(word.rsplit(" ", 1)[-1] for word in line.split(","))
    assert main(["ik", *ROBOT, "--kuka", frame, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert np.allclose(np.degrees(facts["q"]), [float(q) for q in Q.split(",")], rtol=0, atol=2e-3)
    assert facts["turn"] == 76
    assert main(["ik", *ROBOT, "--kuka", frame.rsplit(",", 1)[0]]) == 0
    assert "Status 2, Turn 76" in capsys.readouterr().out


def test_json_of_fk(capsys: Capture) -> None:
    assert main(["fk", *ROBOT, "--kuka", "--json", Q]) == 0
    facts = json.loads(capsys.readouterr().out)["kuka"]
    q = np.radians([float(word) for word in Q.split(",")])
    frame = aa.kuka.to_frame(aa.Arm.from_catalogue(ROBOT[1]), q)
    assert facts == {"e1": frame.e1, "status": 2, "turn": 76, "abc": aa.kuka.abc(frame.pose).tolist()}


@pytest.mark.parametrize(("words", "status", "said"), [
    (("--kuka", "1,2,3"), 2, "holds 3 numbers"),
    (("--kuka", "1,2,3,4,5,6,7,x"), 2, "wanted numbers"),
    (("--kuka", "400,0,500,0,180,0,10,2", "--gc", "1"), 2, "--gc does not go with --kuka"),
    (("--kuka", "400,0,500,0,180,0,10,9"), 2, "status is 9"),
    (("--kuka", "9000,0,500,0,180,0,10,2"), 1, "out of reach"),
])  # fmt: skip
def test_bad_frames(words: tuple[str, ...], status: int, said: str, capsys: Capture) -> None:
    assert main(["ik", *ROBOT, *words]) == status
    assert said in capsys.readouterr().err
