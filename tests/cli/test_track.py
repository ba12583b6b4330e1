"""``armangle track``: a stream of poses through the tracker."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from support.needs import need

import armangle as aa
from armangle.cli import main

ROBOT = ("--robot", "kuka_iiwa7_r800")
ARM = aa.Arm.from_catalogue(ROBOT[1])
START = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
DEGREES = ",".join(f"{angle:.17g}" for angle in np.degrees(START))
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def hand(tmp_path: Path) -> Path:
    """A file of 200 poses that go out of reach and come back."""
    poses = np.repeat(ARM.forward(START)[0][None], 200, axis=0)
    poses[:, :2, 3] += np.sin(np.linspace(0, np.pi, 200))[:, None] ** 2 * np.array([0.7, 0.2])
    aa.io.save(poses, tmp_path / "hand.csv")
    return tmp_path / "hand.csv"


def ran(hand: Path, **options: object) -> list[aa.types.Tracked]:
    tracker = aa.Tracker(ARM, dt=1 / 100, **options)  # type: ignore[arg-type]  # any options
    tracker.start(START)
    return [tracker.step(pose) for pose in aa.io.load_poses(hand)]


@pytest.mark.parametrize("ending", ["csv", "npz", "json", "yaml"])
def test_what_is_written_is_what_a_tracker_does(hand: Path, ending: str, capsys: Capture) -> None:
    to = hand.with_suffix(f".out.{ending}")
    words = ["track", str(hand), *ROBOT, "--start", DEGREES, "--rate", "100"]
    assert main([*words, "-o", str(to)]) == 0
    assert "distance from the target, rms" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    ticks = ran(hand)
    found = aa.io.load_trajectory(to)
    assert len(found) == len(ticks) + 1
    np.testing.assert_allclose(found.q, np.stack([START, *(tick.q for tick in ticks)]), atol=1e-12)
    np.testing.assert_allclose(np.diff(found.q, axis=0) / 0.01, found.qd[1:], atol=1e-9)
    assert np.abs(found.qdd).max() <= 10.0 * (1 + 1e-9)
    assert sum(facts["status"].values()) == len(ticks)
    assert facts["status"] == {
        status.name: sum(tick.status == status for tick in ticks) for status in aa.Tracking
    }
    assert facts["distance"]["max"] == pytest.approx(max(tick.distance for tick in ticks))
    assert facts["gap"] == pytest.approx(max(tick.gap for tick in ticks))
    np.testing.assert_allclose(facts["fastest"], np.abs(found.qd).max(axis=0))


def test_bounds_and_the_filter_are_handed_on(hand: Path, capsys: Capture) -> None:
    words = ["track", str(hand), *ROBOT, "--start", DEGREES, "--rate", "100", "--json", "--filter"]
    assert main([*words, "--velocity", "30", "--acceleration", "100"]) == 0
    facts = json.loads(capsys.readouterr().out)
    ticks = ran(hand, velocity=np.radians(30.0), acceleration=np.radians(100.0), filter=aa.HandFilter())
    assert facts["distance"]["last"] == pytest.approx(ticks[-1].distance, abs=1e-12)
    assert np.degrees(max(facts["fastest"])) <= 30 * (1 + 1e-9)
    assert np.degrees(max(facts["hardest"])) <= 100 * (1 + 1e-9)


def test_it_starts_far_from_limits_and_draws(hand: Path, capsys: Capture) -> None:
    need("matplotlib")
    picture = hand.with_suffix(".png")
    assert main(["track", str(hand), *ROBOT, "--json", "--plot", str(picture)]) == 0
    facts = json.loads(capsys.readouterr().out)
    np.testing.assert_allclose(facts["start"], ARM.solve(aa.io.load_poses(hand)[0], prefer="margin").q)
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert facts["plot"] == str(picture)


@pytest.mark.parametrize(
    ("words", "status", "message"),
    [
        (("--rate", "0"), 2, "--rate is 0, wanted cycles per second"),
        (("--start", "0,0,0,-200,0,0,0"), 2, "--start is outside the limits"),
        (("--velocity", "1,2"), 2, "--velocity has 2 numbers, wanted 7"),
        (("--plot", "x.bmp2"), 2, "x.bmp2: unknown ending"),
    ],
)
def test_what_it_refuses(
    hand: Path, words: tuple[str, ...], status: int, message: str, capsys: Capture
) -> None:
    assert main(["track", str(hand), *ROBOT, *words]) == status
    assert message in " ".join(capsys.readouterr().err.split())


def test_a_first_pose_that_no_posture_holds_needs_a_start(hand: Path, capsys: Capture) -> None:
    poses = aa.io.load_poses(hand).copy()
    poses[:, 0, 3] += 3.0
    aa.io.save(poses, hand)
    assert main(["track", str(hand), *ROBOT]) == 1
    assert "no joints hold the first pose" in " ".join(capsys.readouterr().err.split())
    assert main(["track", str(hand), *ROBOT, "--start", DEGREES]) == 0
    aa.io.save(np.empty((0, 4, 4)), hand)
    assert main(["track", str(hand), *ROBOT]) == 2


def test_it_says_why_and_by_whom_the_hand_was_stopped(hand: Path, tmp_path: Path, capsys: Capture) -> None:
    wall = tmp_path / "wall.toml"
    pose = ARM.forward(START)[0]
    at = pose[0, 3] - ARM.d_wf * pose[0, 2] + 0.1  # 55 mm before the forearm
    wall.write_text(f'[[half_space]]\nname = "wall"\nnormal = [-1, 0, 0]\noffset = {-at}\n')
    words = ["track", str(hand), *ROBOT, "--start", DEGREES, "--rate", "100"]
    scene = ["--scene", str(wall), "--body", "50,45"]
    assert main([*words, *scene, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    named = [one for one in facts["reasons"] if one["obstacle"] == "wall"]
    assert named and all(one["why"] in ("CLEARANCE", "POSE_BLOCKED") and one["link"] for one in named)
    assert sum(one["ticks"] for one in facts["reasons"]) == facts["ticks"] - facts["status"]["FOLLOWING"]
    assert main([*words, *scene]) == 0
    assert f"{named[0]['why']}: {named[0]['link']} at wall" in capsys.readouterr().out
    assert main(words) == 0
    assert "UNREACHABLE" in capsys.readouterr().out


@pytest.mark.parametrize("cells", [",,,,,,", "nan,nan,nan,nan,nan,nan,nan", " , ,nan,,,,"])
def test_samples_that_did_not_come_are_held(hand: Path, cells: str, capsys: Capture) -> None:
    lines = hand.read_text().splitlines()
    lines[50:60] = [cells] * 10
    hand.write_text("\n".join(lines))
    assert main(["track", str(hand), *ROBOT, "--start", DEGREES, "--rate", "100", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["ticks"] == 200
    assert said["status"]["HELD"] == 10
    lost = aa.io.load_poses(hand, lost=True)
    assert np.isnan(lost[49:59]).all() and np.isfinite(np.delete(lost, np.s_[49:59], axis=0)).all()
    with pytest.raises(aa.ModelError, match=r":51.*(a row of empty cells|x is nan|x is empty)"):
        aa.io.load_poses(hand)
    words = ["plan", str(hand), *ROBOT, "--start", DEGREES, "--policy", "hold"]
    assert main([*words, "-o", str(hand.with_suffix(".npz"))]) == 2


def test_empty_rows_at_the_end_of_a_file_are_no_samples(hand: Path) -> None:
    hand.write_text(hand.read_text() + ",,,,,,\n,,,,,,\n\n")
    assert len(aa.io.load_poses(hand)) == 200


def test_times_of_the_file_say_how_fast_it_came_and_what_was_lost(hand: Path, capsys: Capture) -> None:
    lines = hand.read_text().splitlines()
    t = np.arange(200) / 50
    t[120:] += 0.4  # nothing came
    rows = [f"{time:.4f},{line}" for time, line in zip(t, lines[1:], strict=True)]
    hand.write_text("\n".join([f"t,{lines[0]}", *rows]))
    words = ["track", str(hand), *ROBOT, "--start", DEGREES, "--json"]
    assert main(words) == 0
    said = capsys.readouterr()
    facts = json.loads(said.out)
    assert "50 cycles a second, by the file's t, 20 cycles without a row" in " ".join(said.err.split())
    assert sum(facts["status"].values()) == 220 and facts["status"]["HELD"] == 20
    assert main([*words, "--rate", "100"]) == 0
    said = capsys.readouterr()
    assert "the column t, 4.38 s, is left out" in " ".join(said.err.split())
    assert sum(json.loads(said.out)["status"].values()) == 200
    assert main([*words, "--rate", "45.5"]) == 0  # as long as t says
    assert "left out" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("times", "why"),
    [
        ([0, 0.01, 0.005, 0.02], "t does not rise from row 2 to 3"),
        ([0, "", 0.01, 0.02], "t does not rise from row 1 to 2"),
        ([0, 20, 40, 60], "t rises by 20 a row, up to 60, wanted s"),
    ],
)
def test_times_that_are_none_are_refused(hand: Path, times: list[object], why: str, capsys: Capture) -> None:
    lines = hand.read_text().splitlines()[:5]
    rows = [f"{time},{line}" for time, line in zip(times, lines[1:], strict=True)]
    hand.write_text("\n".join([f"t,{lines[0]}", *rows]))
    words = ["track", str(hand), *ROBOT, "--start", DEGREES]
    assert main(words) == 2
    assert why in " ".join(capsys.readouterr().err.split())
    assert main([*words, "--rate", "50"]) == 0


def test_with_a_rate_any_column_t_will_do(hand: Path, capsys: Capture) -> None:
    lines = hand.read_text().splitlines()[:5]
    hand.write_text("\n".join([f"t,{lines[0]}", *(f"noon,{line}" for line in lines[1:])]))
    words = ["track", str(hand), *ROBOT, "--start", DEGREES]
    assert main(words) == 2
    assert "t is 'noon', wanted a number" in capsys.readouterr().err
    assert main([*words, "--rate", "50"]) == 0


def test_millimetres_are_asked_about(hand: Path, capsys: Capture) -> None:
    poses = aa.io.load_poses(hand)
    poses[:, :3, 3] *= 1e3
    aa.io.save(poses, hand)
    assert main(["track", str(hand), *ROBOT, "--start", DEGREES]) == 2
    assert "was this in mm?" in " ".join(capsys.readouterr().err.split())
