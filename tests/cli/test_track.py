"""``armangle track``: a stream of poses through the tracker."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from support.moves import begun, refused
from support.needs import need

import armangle as aa

from .conftest import Cli

ARM = aa.Arm.from_catalogue("kuka_iiwa7_r800")
START = np.array([0.1, 0.4, 0.2, -1.2, 0.3, 0.8, 0.5])
TRACK = f"track hand.csv {{R}} --start {','.join(f'{angle:.17g}' for angle in np.degrees(START))}"


@pytest.fixture(autouse=True)
def hand(cli: Cli) -> Path:
    """The file hand.csv of 200 poses that go out of reach and come back."""
    poses = np.repeat(ARM.forward(START)[0][None], 200, axis=0)
    poses[:, :2, 3] += np.sin(np.linspace(0, np.pi, 200))[:, None] ** 2 * np.array([0.7, 0.2])
    aa.io.save(poses, "hand.csv")
    return Path("hand.csv")


def ran(**options: object) -> list[aa.types.Tracked]:
    """Return the result of each cycle of a tracker along the file's poses."""
    tracker = begun(START, ARM, dt=1 / 100, **options)
    return [tracker.step(pose) for pose in aa.io.load_poses("hand.csv")]


@pytest.mark.parametrize("ending", ["csv", "npz", "json", "yaml"])
def test_what_is_written_is_what_a_tracker_does(ending: str, cli: Cli) -> None:
    """`armangle track` writes and sums up what a Tracker returns for the same poses."""
    assert "distance from the target, rms" in cli(f"{TRACK} --rate 100 -o out.{ending}").out
    facts, ticks, found = (
        cli(f"{TRACK} --rate 100 --json").facts,
        ran(),
        aa.io.load_trajectory(f"out.{ending}"),
    )
    assert len(found) == len(ticks) + 1
    np.testing.assert_allclose(found.q, np.stack([START, *(tick.q for tick in ticks)]), atol=1e-12)
    np.testing.assert_allclose(np.diff(found.q, axis=0) / 0.01, found.qd[1:], atol=1e-9)
    assert np.abs(found.qdd).max() <= 10.0 * (1 + 1e-9)
    assert sum(facts["status"].values()) == len(ticks)
    assert facts["status"] == {one.name: sum(tick.status == one for tick in ticks) for one in aa.Tracking}
    assert facts["distance"]["max"] == pytest.approx(max(tick.distance for tick in ticks))
    assert facts["gap"] == pytest.approx(max(tick.gap for tick in ticks))
    np.testing.assert_allclose(facts["fastest"], np.abs(found.qd).max(axis=0))


def test_bounds_and_the_filter_are_handed_on(cli: Cli) -> None:
    """`armangle track` hands --velocity, --acceleration and --filter to the Tracker."""
    facts = cli(f"{TRACK} --rate 100 --json --filter --velocity 30 --acceleration 100").facts
    ticks = ran(velocity=np.radians(30.0), acceleration=np.radians(100.0), filter=aa.HandFilter())
    assert facts["distance"]["last"] == pytest.approx(ticks[-1].distance, abs=1e-12)
    assert np.degrees(max(facts["fastest"])) <= 30 * (1 + 1e-9)
    assert np.degrees(max(facts["hardest"])) <= 100 * (1 + 1e-9)


def test_it_starts_far_from_limits_and_draws(cli: Cli) -> None:
    """`armangle track` without --start begins at `solve(prefer="margin")`, and draws --plot."""
    need("matplotlib")
    facts = cli("track hand.csv {R} --json --plot hand.png").facts
    first = aa.io.load_poses("hand.csv")[0]
    np.testing.assert_allclose(facts["start"], ARM.solve(first, prefer="margin").q)
    assert Path("hand.png").read_bytes().startswith(b"\x89PNG") and facts["plot"] == "hand.png"


@pytest.mark.parametrize(("words", "said"), [
    ("--rate 0", "--rate is 0"), ("--start 0,0,0,-200,0,0,0", "--start is outside the limits"),
    ("--velocity 1,2", "--velocity has 2 numbers"), ("--plot x.bmp2", "x.bmp2: unknown ending"),
])  # fmt: skip
def test_what_it_refuses(words: str, said: str, cli: Cli) -> None:
    """`armangle track` refuses bad options with exit status 2."""
    told = cli(f"track hand.csv {{R}} {words}")
    assert told.status == 2 and said in told.text


def test_a_first_pose_that_no_posture_holds_needs_a_start(cli: Cli) -> None:
    """`armangle track` needs --start if the first pose is out of reach; mm and no poses are refused."""
    poses = aa.io.load_poses("hand.csv").copy()
    poses[:, 0, 3] += 3.0
    aa.io.save(poses, "hand.csv")
    told = cli("track hand.csv {R}")
    assert told.status == 1 and "no joints hold the first pose" in told.text
    assert cli(TRACK).status == 0
    poses[:, :3, 3] *= 1e3
    aa.io.save(poses, "hand.csv")
    told = cli(TRACK)
    assert told.status == 2 and "was this in mm?" in told.text
    aa.io.save(np.empty((0, 4, 4)), "hand.csv")
    assert cli("track hand.csv {R}").status == 2


def test_it_says_why_and_by_whom_the_hand_was_stopped(cli: Cli) -> None:
    """`armangle track` counts the reasons why it did not follow, with obstacle and link."""
    pose = ARM.forward(START)[0]
    at = pose[0, 3] - ARM.geometry.d_wf * pose[0, 2] + 0.1  # 55 mm before the forearm
    Path("wall.toml").write_text(f'[[half_space]]\nname = "wall"\nnormal = [-1, 0, 0]\noffset = {-at}\n')
    scene = f"{TRACK} --rate 100 --scene wall.toml --body 50,45"
    facts = cli(f"{scene} --json").facts
    named = [one for one in facts["reasons"] if one["obstacle"] == "wall"]
    assert named and all(one["why"] in ("CLEARANCE", "POSE_BLOCKED") and one["link"] for one in named)
    assert sum(one["ticks"] for one in facts["reasons"]) == facts["ticks"] - facts["status"]["FOLLOWING"]
    assert f"{named[0]['why']}: {named[0]['link']} at wall" in cli(scene).out
    assert "UNREACHABLE" in cli(f"{TRACK} --rate 100").out


@pytest.mark.parametrize("cells", [",,,,,,", "nan,nan,nan,nan,nan,nan,nan", " , ,nan,,,,"])
def test_samples_that_did_not_come_are_held(hand: Path, cells: str, cli: Cli) -> None:
    """`armangle track` holds at rows of empty or NaN cells, which other commands refuse."""
    lines = hand.read_text().splitlines()
    lines[50:60] = [cells] * 10
    hand.write_text("\n".join(lines))
    said = cli(f"{TRACK} --rate 100 --json").facts
    assert said["ticks"] == 200 and said["status"]["HELD"] == 10
    lost = aa.io.load_poses(hand, lost=True)
    assert (
        len(lost) == 200
        and np.isnan(lost[49:59]).all()
        and np.isfinite(np.delete(lost, np.s_[49:59], 0)).all()
    )
    refused(aa.ModelError, ":51.*(a row of empty cells|x is nan|x is empty)", aa.io.load_poses, hand)
    assert cli(f"{TRACK.replace('track', 'plan')} --policy hold -o hand.npz").status == 2


def test_empty_rows_at_the_end_of_a_file_are_no_samples(hand: Path) -> None:
    """`load_poses` leaves out empty rows at the end of a file."""
    hand.write_text(hand.read_text() + ",,,,,,\n,,,,,,\n\n")
    assert len(aa.io.load_poses(hand)) == 200


def with_times(hand: Path, times: object, count: int | None = None) -> None:
    """Put a column t before the poses; keep the first `count` lines, header included."""
    lines = hand.read_text().splitlines()[:count]
    rows = [f"{time},{line}" for time, line in zip(times, lines[1:], strict=True)]  # type: ignore[call-overload]  # any
    hand.write_text("\n".join([f"t,{lines[0]}", *rows]))


def test_times_of_the_file_say_how_fast_it_came_and_what_was_lost(hand: Path, cli: Cli) -> None:
    """`armangle track` takes rate and lost rows from the column t, unless --rate is given."""
    t = np.arange(200) / 50
    t[120:] += 0.4  # nothing came
    with_times(hand, np.round(t, 4))
    told = cli(f"{TRACK} --json")
    assert "50 cycles a second, by the file's t, 20 cycles without a row" in told.text
    assert sum(told.facts["status"].values()) == 220 and told.facts["status"]["HELD"] == 20
    told = cli(f"{TRACK} --json --rate 100")
    assert "the column t, 4.38 s, is left out" in told.text and sum(told.facts["status"].values()) == 200
    assert "left out" not in cli(f"{TRACK} --json --rate 45.5").err  # as long as t says


@pytest.mark.parametrize(("times", "why"), [
    ([0, 0.01, 0.005, 0.02], "t does not rise from row 2 to 3"),
    ([0, "", 0.01, 0.02], "t does not rise from row 1 to 2"),
    ([0, 20, 40, 60], "t rises by 20 a row, up to 60, wanted s"),
    (["noon"] * 4, "t is 'noon', wanted a number"),
])  # fmt: skip
def test_times_that_are_none_are_refused_without_a_rate(
    hand: Path, times: list[object], why: str, cli: Cli
) -> None:
    """`armangle track` refuses times that do not rise or are no numbers, unless --rate is given."""
    with_times(hand, times, 5)
    told = cli(TRACK)
    assert told.status == 2 and why in told.text
    assert cli(f"{TRACK} --rate 50").status == 0
