"""Reach maps: values are those of the closed form; no death, wound or second writer changes a byte."""

from __future__ import annotations

import os
import resource
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from support import draw
from support.families import OFFSET, of
from support.maps import (
    ARMS,
    OFFSET_ARMS,
    STORED,
    digest,
    killed_and_resumed,
    made,
    peak,
    process,
    small_tiles,
    whole,
)
from support.moves import refused
from support.needs import need
from support.planned_arms import random_arm

import armangle as aa
from armangle.reach import voxels as voxels_module

need("zarr")


def freed(arm: aa.Arm, *joints: int) -> aa.Arm:
    """The arm whose joints (1..7) have no limits."""
    lower, upper = arm.lower.copy(), arm.upper.copy()
    for joint in joints:
        lower[joint - 1], upper[joint - 1] = -np.inf, np.inf
    return arm.with_(lower=lower, upper=upper)


def cells_of(
    found: aa.ReachMap, rng: np.random.Generator, count: int
) -> tuple[tuple[np.ndarray, ...], np.ndarray]:
    """Indices of random cells, and poses at their middles at a random azimuth and roll."""
    index = tuple(rng.integers(0, n, count) for n in found.shape)
    middles = [axis[k] for axis, k in zip(found.axes.values(), index, strict=True)]
    return index, found.pose(np.column_stack([*middles, rng.uniform(-3, 3, (count, 2))]))


def check_cells(arm: aa.Arm, found: aa.ReachMap, rng: np.random.Generator, count: int) -> int:
    """Compare random cells with the closed form of poses there; return how many of them are reached."""
    index, poses = cells_of(found, rng, count)
    gc, freedom, yaw, roll = (np.asarray(found.values(name)[:])[index] for name in found.fields)
    margin = found.arm.singularity_margin
    has = freed(arm, 1, 7).with_(singularity_margin=margin).freedom(poses)
    assert np.array_equal(gc, has.gc)
    assert np.allclose(freedom, has.total, rtol=2.0**-11, atol=1e-6)
    for share, turns in (
        (yaw, freed(arm, 7).with_(singularity_margin=margin).feasible_turns(poses, about="base")),
        (roll, freed(arm, 1).with_(singularity_margin=margin).feasible_turns(poses, about="tool")),
    ):
        exact = turns.measure / (2 * np.pi)
        assert (share / 255 <= exact + 1e-12).all()  # never rounded up
        assert (share / 255 > exact - 1 / 255 - 1e-9).all()
        assert np.array_equal(share == 255, turns.is_full)
    held = arm.with_(singularity_margin=margin).freedom(poses).gc
    assert (held & ~gc == 0).all()  # what is held with all limits is held at some azimuth and roll
    return int((gc != 0).sum())


@pytest.mark.parametrize("name", ARMS)
def test_cells_are_what_the_closed_form_says_at_their_middles(name: str, tmp_path: Path) -> None:
    """Cells of `reach_map` hold gc, freedom, yaw and roll of the closed form at their middles."""
    found = made(name, tmp_path / "a.zarr", margin=0.05)
    assert found.missing == () and found.verify() == ()
    assert (
        check_cells(aa.Arm.from_catalogue(name), found, draw.generator(16, 20, ARMS.index(name)), 1500) > 200
    )


@pytest.mark.parametrize("name", OFFSET_ARMS)
def test_cells_of_an_arm_with_an_offset_are_what_its_intervals_say(name: str, tmp_path: Path) -> None:
    """Cells of an offset arm with base and tool hold what its own functions give."""
    base, tool = aa.pose([0.1, 0.2, 0.3]), aa.pose([0.05, 0.02, 0.1], rpy=[0.3, 0.2, 0.1])
    arm = aa.Arm.load(name).with_(base=base, tool=tool)
    found = aa.reach_map(arm, tmp_path / "a.zarr", spacing=0.3, tilt=0.5)
    assert found.arm == arm and found.missing == () and found.verify() == ()
    rng = draw.generator(16, 25, OFFSET_ARMS.index(name))
    assert check_cells(arm, found, rng, 300) > 60


@pytest.mark.parametrize("name", OFFSET_ARMS)
def test_every_posture_of_an_arm_with_an_offset_is_within_its_map(name: str, tmp_path: Path) -> None:
    """Poses of random joints of an offset arm lie in its map; samples and voxels are reachable."""
    arm = aa.Arm.load(name)
    found = aa.reach_map(arm, tmp_path / "a.zarr", spacing=0.6, tilt=1.5, fields=("gc",))
    rng = draw.generator(16, 27, OFFSET_ARMS.index(name))
    q = rng.uniform(np.clip(arm.lower, -np.pi, np.pi), np.clip(arm.upper, -np.pi, np.pi), (2000, 7))
    poses = arm.forward(q)[0]
    six = found.coordinates(poses)
    assert np.allclose(found.pose(six), poses, atol=1e-12)
    inner, outer = arm._handle.reduced_distances()
    distance = np.hypot(six[:, 0], six[:, 1])
    assert (distance <= outer + 1e-12).all() and (distance >= inner - 1e-12).all()
    assert distance.max() > 0.97 * outer
    drawn = found.sample(100, seed=5)
    assert arm.reachable(drawn).all() and np.array_equal(drawn[:20], found.sample(20, seed=5))
    voxels = found.voxels(0.5, orientations=10)
    turned = aa.pose(np.zeros(3), wxyz=voxels_module.even_orientations(10))
    for place, share in zip(voxels.position, voxels.share, strict=True):
        turned[:, :3, 3] = place
        assert arm.reachable(turned).mean() == share > 0


def test_nothing_is_unproven_of_an_arm_without_its_own_chain(tmp_path: Path) -> None:
    """The field `unproven` of a nominal arm brings `gc`, and counts nothing."""
    arm = aa.Arm.from_catalogue("kuka_iiwa7_r800")
    found = aa.reach_map(arm, tmp_path / "a.zarr", spacing=0.6, tilt=1.5, fields="unproven")
    assert found.fields == ("gc", "unproven")
    assert found.unproven == 0 and not found.section("unproven").any()


def test_cells_of_random_arms_with_base_tool_signs_offsets(tmp_path: Path) -> None:
    """Cells of maps of random arms hold the closed form at their middles."""
    rng = draw.generator(16, 21)
    held = 0
    for k in range(6):
        base, tool = np.eye(4), aa.pose([0.05, 0.02, 0.1], rpy=[0.3, 0.2, 0.1])
        base[:3, 3] = 0.1, 0.2, 0.3
        arm = random_arm(rng).with_(base=base, tool=tool)
        with aa.threads(1):
            found = aa.reach_map(arm, tmp_path / f"{k}.zarr", spacing=arm.geometry.reach / 4, tilt=0.5)
        assert found.arm == arm
        held += check_cells(arm, found, rng, 300)
    assert held > 200


def check_proven(
    arm: aa.Arm, rng: np.random.Generator, margin: float, counts: tuple[int, int, int], *, fine: float = 1.0
) -> tuple[int, int]:
    """Compare what is proven of random cells (places, tilts, turns) of 10 mm and 0.02 rad, times `fine`, with
    corners and random places in them; return how many are proven reachable, and unreachable.
    """
    steps = fine * np.array([0.01, 0.01, 0.02, 0.02])
    distance = arm._handle.reduced_distances()[1] * rng.uniform(0.2, 1.1, counts[0])
    cone = np.arccos(rng.uniform(-1, 1, counts[0]))
    places = np.column_stack([distance * np.sin(cone) + 0.005, distance * np.cos(cone)])
    tilt, turn = rng.uniform(0.02, 3.1, counts[1]), rng.uniform(-3, 3, counts[2])
    gc, proven, freedom = np.empty(counts, np.uint8), np.empty(counts, np.uint8), np.empty(counts, np.float32)
    arm._handle.map_cells(places, tilt, turn, steps, margin, gc, freedom, None, None, proven, None, 1)
    assert not ((proven == 1) & (gc == 0)).any() and not ((proven == 2) & (gc != 0)).any()
    bare = freed(arm, 1, 7).with_(singularity_margin=margin)
    for code, wanted in ((1, True), (2, False)):
        at = np.argwhere(proven == code)
        middle = np.column_stack([places[at[:, 0]], tilt[at[:, 1]], turn[at[:, 2]]])
        for _ in range(20):  # corners and places between
            off = np.where(
                rng.random(middle.shape) < 0.5,
                rng.choice([-1, 1], middle.shape),
                rng.uniform(-1, 1, middle.shape),
            )
            six = np.column_stack([middle + 0.5 * steps * off, rng.uniform(-3, 3, (len(at), 2))])
            poses = np.empty((len(at), 4, 4))
            arm._handle.poses_of_reduced(six, poses)
            assert (np.asarray(bare.reachable(poses)) == wanted).all()
    return int((proven == 1).sum()), int((proven == 2).sum())


@pytest.mark.parametrize("name", ARMS)
def test_what_is_proven_of_a_cell_holds_everywhere_in_it(name: str, tmp_path: Path) -> None:
    """Corners and random places of a cell whose field proven says reachable or unreachable are so."""
    arm = aa.Arm.from_catalogue(name)
    found = made(name, tmp_path / "a.zarr", spacing=0.1, tilt=0.5, fields=("gc", "proven"))
    rng = draw.generator(16, 26, ARMS.index(name))
    reached, unreached = check_proven(arm, rng, 0.0, (150, 12, 16))
    assert reached > 200 and unreached > 2000
    whole = np.asarray(found.values("proven")[:])
    assert set(np.unique(whole)) <= {0, 1, 2} and (found.section("proven") <= found.section() + 1e-12).all()


@pytest.mark.turns(2)
@of(OFFSET)
@pytest.mark.parametrize("margin", [0.0, 0.1])
def test_what_is_proven_of_a_cell_of_an_arm_with_an_offset_holds_everywhere_in_it(
    arm: aa.Arm, margin: float
) -> None:
    """Corners and random places of a cell of an offset arm that is proven reachable or unreachable are so; of
    small cells many are decided.
    """
    arm = arm.with_(singularity_margin=margin)
    rng = draw.generator(16, 28)
    reached, unreached = check_proven(arm, rng, margin, (draw.count(24), 4, 4), fine=0.5)
    assert reached > 60 and unreached > 4


def test_locked_joints_fall_back_on_the_general_functions(tmp_path: Path) -> None:
    """Cells of an arm with a locked joint hold the closed form at their middles."""
    arm = aa.Arm.from_catalogue("openarm_v10")
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[2] = upper[2] = 0.0
    locked = arm.with_(lower=lower, upper=upper)
    found = aa.reach_map(locked, tmp_path / "a.zarr", spacing=0.1, tilt=0.4)
    check_cells(locked, found, draw.generator(16, 22), 300)


@pytest.mark.parametrize("name", ARMS)
def test_coordinates_are_the_six_numbers_of_a_pose(name: str, tmp_path: Path) -> None:
    """`coordinates` and `pose` are inverse; azimuth and roll alone change no freedom of joints 2 to 6."""
    found = made(name, tmp_path / "a.zarr", spacing=0.2, tilt=0.8)
    rng = draw.generator(16, 23)
    poses = found.sample(300, seed=5)
    arm = found.arm
    assert arm.reachable(poses).all() and np.array_equal(poses, found.sample(300, seed=5))
    six = found.coordinates(poses)
    assert np.allclose(found.pose(six), poses, atol=1e-12)
    turned = six.copy()
    turned[:, 4:] += rng.uniform(-2, 2, (300, 2))
    bare = freed(arm, 1, 7)
    before, after = bare.freedom(poses), bare.freedom(found.pose(turned))
    assert np.array_equal(before.gc, after.gc) and np.allclose(before.total, after.total, atol=1e-8)
    assert np.array_equal(found.at(poses).total, arm.freedom(poses).total)


@pytest.mark.parametrize("name", ARMS)
def test_samples_are_even_over_what_is_reached(name: str, tmp_path: Path) -> None:
    """`sample` has the distribution of random poses that are kept if reachable."""
    found = made(name, tmp_path / "a.zarr", spacing=0.2, tilt=0.8)
    arm = found.arm
    drawn = found.coordinates(found.sample(4000, seed=1))
    rng = draw.generator(16, 24)
    place = rng.uniform(-1, 1, (60_000, 3))
    place = place[np.linalg.norm(place, axis=1) < 1] * arm.geometry.reach
    tilt = np.arccos(rng.uniform(-1, 1, len(place)))
    six = np.column_stack(
        [np.hypot(*place[:, :2].T), place[:, 2], tilt, rng.uniform(-np.pi, np.pi, (len(place), 3))]
    )
    held = six[np.asarray(arm.reachable(found.pose(six)))]
    for column in range(6):  # two samples of one distribution: Kolmogorov and Smirnov, one in 10^5 beyond
        both = np.sort(np.concatenate([drawn[:, column], held[:, column]]))
        apart = [np.searchsorted(np.sort(x[:, column]), both, side="right") / len(x) for x in (drawn, held)]
        assert np.abs(apart[0] - apart[1]).max() < 2.5 * np.sqrt(1 / len(drawn) + 1 / len(held))


@pytest.mark.parametrize("name", ARMS)
def test_voxels_and_sections_count_what_is_held(name: str, tmp_path: Path) -> None:
    """`voxels` and `section` hold the shares of reachable orientations, counted one by one."""
    found = made(name, tmp_path / "a.zarr", spacing=0.1, tilt=0.3)
    arm = found.arm
    voxels = found.voxels(0.2, orientations=40)
    from armangle.reach.voxels import even_orientations

    turned = aa.pose(np.zeros(3), wxyz=even_orientations(40))
    for k in range(0, len(voxels.share), 7):
        poses = turned.copy()
        poses[:, :3, 3] = voxels.position[k]
        assert arm.reachable(poses).mean() == voxels.share[k] > 0
    section = found.section()
    sines = np.sin(found.axes["tilt"])
    held = (found.values("gc")[3, 5] != 0).mean(axis=1)
    assert section[3, 5] == pytest.approx((held * sines).sum() / sines.sum())
    assert section.shape == found.shape[:2] and 0 < section.max() <= 1 + 1e-12
    assert (found.section("yaw") <= section + 1e-12).all() and (
        found.section("roll") <= section + 1e-12
    ).all()


def test_orientations_are_spread_evenly() -> None:
    """`even_orientations` are unit quaternions, each about as far from its nearest as the others."""

    from armangle.reach.voxels import even_orientations

    q = even_orientations(2000)
    assert np.allclose(np.linalg.norm(q, axis=1), 1)
    nearest = np.sort(np.abs(q @ q.T), axis=1)[:, -2]  # each has its neighbour about as far as any other
    angles = 2 * np.arccos(np.minimum(nearest, 1))
    assert angles.min() > 0.5 * angles.max()


# -- deaths, wounds, other writers ----------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", STORED)
def test_killed_at_random_times_and_resumed_every_byte_is_equal(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A map killed at random times and resumed has the bytes of one made in one run."""
    small_tiles(monkeypatch)
    options = {"spacing": 0.02, "tilt": 0.13}
    place, rng = tmp_path / "killed.zarr", draw.generator(16, 25, ARMS.index(name))
    assert killed_and_resumed(name, place, rng, [False] * 2, **options) > 0
    resumed = made(name, place, **options)
    assert resumed.tiles > 20 and resumed.missing == () and resumed.verify() == ()
    assert digest(place) == whole(name, **options)


@pytest.mark.parametrize("name", STORED)
def test_killed_before_it_was_a_map(name: str, tmp_path: Path) -> None:
    """A folder left without the file that is written last becomes the map of one run."""
    place = tmp_path / "a.zarr"
    made(name, place, part=(3, 3))
    (place / "zarr.json").unlink()  # what is written last
    for array in ("gc", "done", "turn"):
        for file in (place / array).rglob("*"):
            if file.is_file() and "c" in file.relative_to(place / array).parts:
                file.unlink()
    made(name, place)
    assert digest(place) == whole(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", STORED)
def test_two_processes_on_one_store(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two processes that make one map at once leave the bytes of one run."""
    small_tiles(monkeypatch)
    options = {"spacing": 0.03, "tilt": 0.13}
    both = [process(name, tmp_path / "a.zarr", **options) for _ in range(2)]
    for one in both:
        assert one.communicate()[1] == "" and one.returncode == 0
    assert digest(tmp_path / "a.zarr") == whole(name, **options)


def flipped(file: Path) -> None:
    """Change one bit in the middle of a file."""
    bits = bytearray(file.read_bytes())
    bits[len(bits) // 2] ^= 4
    file.write_bytes(bytes(bits))


@pytest.mark.parametrize("name", STORED)
def test_wounded_tiles_are_named_say_so_when_read_and_are_made_again(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`verify` names damaged tiles, reading them raises, and `resume` makes them again."""
    small_tiles(monkeypatch, 2**14)
    place = tmp_path / "a.zarr"
    found = made(name, place)
    values, along = np.asarray(found.values("freedom")), found._store.grid.along
    tiles = [k for k in range(found.tiles) if found._store.read(k)["freedom"].any()][:6]
    assert len(tiles) == 6

    def file(field: str, tile: int) -> Path:
        """The file of a tile of a field."""
        i, j = divmod(tile, along)
        return place / field / "c" / (str(tile) if field == "done" else f"{i}/{j}/0/0")

    truncated, bit, removed, markless, wrong_mark, short_mark = tiles
    flipped(file("freedom", bit))
    for read in (lambda: found.values("freedom")[:], lambda: np.asarray(found.values("freedom")),
                 lambda: found.section("freedom")):  # fmt: skip
        refused(aa.ModelError, rf"tile {bit} of field 'freedom' is damaged.*verify", read)
    assert found.values("gc")[0, 0].shape == found.shape[2:]  # another field, and other tiles, can be read
    refused(IndexError, "", found.values("gc").__getitem__, 10**6)
    old = file("freedom", truncated).read_bytes()
    file("freedom", truncated).write_bytes(old[: len(old) // 2])
    file("gc", removed).unlink()  # a mark without its data
    file("done", markless).unlink()
    file("done", wrong_mark).write_bytes(b"\1\2\3\4")
    (place / "freedom" / "c" / "0" / "left.0123.partial").write_bytes(b"x")
    assert found.missing == (markless,)
    assert set(aa.ReachMap(place).verify()) == {truncated, bit, removed, wrong_mark}
    file("done", short_mark).write_bytes(b"\1")  # half a mark is none
    assert set(aa.ReachMap(place).missing) == set(tiles)
    with aa.threads(1):
        assert found.resume().missing == ()
    assert digest(place) == whole(name) and np.array_equal(found.values("freedom"), values)


@pytest.mark.parametrize("wound", [("zarr.json", b"{"), ("zarr.json", b"{}"), ("gc/zarr.json", b"no")])
def test_a_map_without_its_description_is_refused(wound: tuple[str, bytes], tmp_path: Path) -> None:
    """`ReachMap` refuses a store whose zarr.json is damaged."""
    place = tmp_path / "a.zarr"
    made("openarm_v10", place, spacing=0.3, tilt=1.0)
    (place / wound[0]).write_bytes(wound[1])
    with pytest.raises(aa.ModelError):
        aa.ReachMap(place).section("gc")


@pytest.mark.parametrize("name", STORED)
def test_a_full_disk_is_said_and_resumed_from(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`reach_map` raises when files may not grow beyond 2 kB, and goes on when they may again."""
    small_tiles(monkeypatch)
    place = tmp_path / "a.zarr"
    made(name, place, part=(1, 99))
    old = resource.getrlimit(resource.RLIMIT_FSIZE)
    ignored = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (2048, old[1]))
    try:
        refused(aa.OutputError, "cannot be written", lambda: made(name, place))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, old)
        signal.signal(signal.SIGXFSZ, ignored)
    made(name, place)
    assert digest(place) == whole(name)


FULL = """
import subprocess, sys
import armangle as aa
from armangle.reach import grid
from support.maps import digest
from pathlib import Path

grid._CELLS, place, name = 2**13, Path(sys.argv[1]), sys.argv[2]
mount = ["mount", "-t", "tmpfs", "-o"]
subprocess.run([*mount, "size=64k", "tmpfs", str(place)], check=True)
make = lambda: aa.reach_map(aa.Arm.from_catalogue(name), place / "a.zarr", spacing=0.05, tilt=0.2)
try:
    make()
except aa.OutputError as error:
    print(error)
subprocess.run([*mount, "remount,size=64m", "tmpfs", str(place)], check=True)
assert aa.ReachMap(place / "a.zarr").missing
assert make().missing == ()
print(digest(place / "a.zarr"))
"""


@pytest.mark.slow
@pytest.mark.parametrize("name", STORED)
def test_a_full_file_system_is_said_and_resumed_from(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`reach_map` raises on a full file system of 64 kB, and goes on when it grows."""
    spaces = ["unshare", "--user", "--map-root-user", "--mount"]
    if shutil.which("unshare") is None or subprocess.run([*spaces, "true"], check=False).returncode:
        pytest.skip("no namespaces for a file system of our own: unshare is missing or not allowed")
    small_tiles(monkeypatch, 2**13)
    (tmp_path / "small").mkdir()
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[1])}
    words = [*spaces, sys.executable, "-c", FULL, str(tmp_path / "small"), name]
    run = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    said, bytes_of_all = run.stdout.splitlines()
    assert "cannot be written: No space left on device" in said
    assert bytes_of_all == whole(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", STORED)
def test_memory_does_not_grow_with_a_map(name: str, tmp_path: Path) -> None:
    """A map of more than nine times the cells takes less than 40 MiB more, and less than 500 MiB in all."""
    small = peak(name, tmp_path / "small.zarr", spacing=0.04, tilt=0.15)
    large = peak(name, tmp_path / "large.zarr", spacing=0.0125, tilt=0.15)
    cells = [np.prod(aa.ReachMap(tmp_path / f"{size}.zarr").shape) for size in ("small", "large")]
    assert cells[1] > 9 * cells[0] > 1e6
    assert large < small + 40 < 500


@pytest.mark.parametrize("name", STORED)
def test_a_map_of_something_else_is_refused(name: str, tmp_path: Path) -> None:
    """`reach_map` refuses a store of another grid, margin, fields or arm, and leaves it as it was."""
    place = tmp_path / "a.zarr"
    made(name, place)
    whole = digest(place)
    for changes, said in (
        ({"spacing": 0.04}, "grid that differs in spacing"),
        ({"tilt": 0.3}, "grid that differs in tilts, turns"),
        ({"margin": 0.1}, "singularity_margin 0.0, not 0.1"),
        ({"fields": ("gc",)}, "fields"),
    ):
        with pytest.raises(aa.InputError, match=said):
            made(name, place, **changes)
    arm = aa.Arm.from_catalogue(name)
    other = arm.with_(upper=arm.upper + 1e-9)
    with pytest.raises(aa.InputError, match="arm that differs in upper: give another place"):
        aa.reach_map(other, place, spacing=0.05, tilt=0.2)
    assert digest(place) == whole


@pytest.mark.parametrize("name", STORED)
def test_another_instruction_set_is_refused(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A map begun with another instruction set is neither resumed nor made on."""

    from armangle.reach import store

    place = tmp_path / "a.zarr"
    begun = made(name, place, part=(99, 99))
    assert begun.missing
    monkeypatch.setattr(store, "ISA", "other")
    refused(aa.InputError, r"isa '\w+', not 'other'.*ARMANGLE_ISA=\w+ takes", lambda: made(name, place))
    refused(aa.InputError, "not 'other'", lambda: aa.ReachMap(place).resume())


@pytest.mark.parametrize("name", STORED)
def test_parts_make_the_whole_whatever_their_order(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The parts of a map, in another order, leave the bytes of one run and report each tile once."""
    small_tiles(monkeypatch, 2**14)
    place = tmp_path / "a.zarr"
    told: list[tuple[int, int]] = []
    for i in (3, 1, 2):
        found = made(name, place, part=(i, 3), progress=lambda *now: told.append(now))
        assert (found.missing == ()) == (i == 2)
    assert digest(place) == whole(name)
    assert len(told) == found.tiles and told[-1][0] == told[-1][1]
    assert f"{found.tiles} of {found.tiles} tiles made" in repr(found)


@pytest.mark.parametrize("name", STORED)
def test_tiles_without_a_reachable_cell_count_as_made(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Tiles that hold nothing reachable are neither missing nor damaged."""
    small_tiles(monkeypatch, 2**12)
    found = made(name, tmp_path / "a.zarr", spacing=0.05, tilt=0.3)
    empty = [k for k in range(found.tiles) if not found._store.read(k)["gc"].any()]
    assert empty and found.missing == () and found.verify() == ()


def test_xarray_opens_it(tmp_path: Path) -> None:
    """`to_xarray` has the map's axes, units and values."""
    need("xarray")
    found = made("openarm_v10", tmp_path / "a.zarr")
    data = found.to_xarray()
    assert tuple(data.sizes[name] for name in found.axes) == found.shape
    assert np.array_equal(data["gc"].sel(r=0.21, z=0.11, method="nearest"), found.values("gc")[
        int(np.abs(found.axes["r"] - 0.21).argmin()), int(np.abs(found.axes["z"] - 0.11).argmin())
    ])  # fmt: skip
    assert data["tilt"].attrs["units"] == "rad"


def test_what_is_no_map(tmp_path: Path) -> None:
    """`ReachMap` and `reach_map` refuse no folder, a file, a folder of other things and another format."""
    refused(aa.ModelError, "there is no reach map", lambda: aa.ReachMap(tmp_path / "none.zarr"))
    file = tmp_path / "file"
    file.write_text("x")
    refused(aa.InputError, "is a file, wanted a folder", lambda: made("openarm_v10", file))
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").write_text("x")
    with pytest.raises(aa.InputError, match=r"holds 'thesis.tex' and no reach map"):
        made("openarm_v10", tmp_path / "full")
    made("openarm_v10", tmp_path / "a.zarr", part=(99, 99))
    (tmp_path / "a.zarr" / "zarr.json").write_text(
        '{"zarr_format": 3, "node_type": "group", "attributes": {"a": 1}}'
    )
    refused(aa.ModelError, "format is None, wanted 1", lambda: made("openarm_v10", tmp_path / "a.zarr"))


def test_an_object_store_by_its_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A map at an fsspec address (here in memory) is made, read, damaged, mended and refused as on disk."""
    fsspec = need("fsspec")
    small_tiles(monkeypatch, 2**12)
    arm, place = aa.Arm.from_catalogue("openarm_v10"), f"memory://{tmp_path.name}/a.zarr"
    half = aa.reach_map(arm, place, spacing=0.1, tilt=0.6, part=(1, 2))
    assert half.missing
    found = aa.reach_map(arm, place, spacing=0.1, tilt=0.6)
    here = made("openarm_v10", tmp_path / "a.zarr", spacing=0.1, tilt=0.6)
    assert found.path == place
    for name in found.fields:
        assert np.array_equal(aa.ReachMap(place).values(name), here.values(name))
    files, chunk = fsspec.filesystem("memory"), f"/{tmp_path.name}/a.zarr/gc/c/0/1/0/0"
    bits = bytearray(files.cat_file(chunk))
    bits[len(bits) // 2] ^= 4
    files.pipe_file(chunk, bytes(bits))
    assert found.verify() == (1,)
    assert found.resume().missing == ()
    assert np.array_equal(found.values("gc"), here.values("gc"))
    with pytest.raises(aa.InputError, match="is a map with grid that differs in spacing"):
        aa.reach_map(arm, place, spacing=0.2, tilt=0.6)
    with pytest.raises(aa.ModelError, match="there is no reach map"):
        aa.ReachMap(f"memory://{tmp_path.name}/none.zarr")
    files.rm(f"/{tmp_path.name}", recursive=True)
