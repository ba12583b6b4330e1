"""A reach map made by a Dask cluster: the same bytes as by threads, whoever dies."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support import draw
from support.maps import ARMS, CLUSTERED, digest, killed_and_resumed, made, small_tiles, whole
from support.needs import need

import armangle as aa

need("zarr")
distributed = need("distributed")


@pytest.fixture
def cluster() -> Iterator[Any]:
    """One worker, in a process of its own, started again when it dies."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as running:
        yield running


@pytest.mark.slow
@pytest.mark.parametrize("name", CLUSTERED)
def test_a_cluster_writes_the_bytes_that_threads_write(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cluster: Any
) -> None:
    """`reach_map` by a Dask cluster writes the same bytes as by threads."""
    small_tiles(monkeypatch)
    told: list[tuple[int, int]] = []
    found = made(
        name, tmp_path / "a.zarr", scheduler=cluster.scheduler_address, progress=lambda *now: told.append(now)
    )
    assert found.missing == () and told[-1] == (found.tiles, found.tiles)
    assert digest(tmp_path / "a.zarr") == whole(name)


@pytest.mark.slow
@pytest.mark.parametrize("name", CLUSTERED)
def test_killed_with_its_cluster_at_random_times_every_byte_is_equal(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A map killed with its Dask cluster, by turns with threads, and resumed is that of one run."""
    small_tiles(monkeypatch)
    options = {"spacing": 0.02, "tilt": 0.13}
    place, rng = tmp_path / "killed.zarr", draw.generator(16, 27, ARMS.index(name))
    turns = [True, False, True, False, True] if draw.COUNT else [True, False]
    assert killed_and_resumed(name, place, rng, turns, **options) >= len(turns) // 2
    resumed = made(name, place, **options)
    assert resumed.missing == () and resumed.verify() == ()
    assert digest(place) == whole(name, **options)


@pytest.mark.slow
@pytest.mark.parametrize("name", CLUSTERED)
def test_a_worker_killed_on_one_tile_until_it_is_given_up(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cluster: Any
) -> None:
    """A tile whose worker died twice, so that Dask gave it up, is asked for again and made."""
    cluster.scheduler.allowed_failures = 1
    small_tiles(monkeypatch, 2**23)
    options: dict[str, Any] = {"spacing": 0.02, "tilt": 0.035}
    whole = made(name, tmp_path / "whole.zarr", part=(1, 4), **options)
    given_up: list[BaseException] = []
    client = distributed.Client(cluster)
    plain = client.map

    def watched(*words: Any, **more: Any) -> Any:
        """Map, and note the errors of what was given up."""
        futures = plain(*words, **more)
        for future in futures:
            future.add_done_callback(lambda f: f.status == "error" and given_up.append(f.exception()))
        return futures

    monkeypatch.setattr(client, "map", watched)
    run = threading.Thread(
        target=made, args=(name, tmp_path / "a.zarr"),
        kwargs={"part": (1, 4), "scheduler": client, **options},
    )  # fmt: skip
    run.start()
    killed = 0
    deadline = time.monotonic() + 300
    while run.is_alive() and killed < 2 and time.monotonic() < deadline:
        busy = [address for address, tasks in client.processing().items() if tasks]
        pids = client.run(os.getpid, on_error="ignore") if busy else {}  # it may be dying
        for pid in pids.values():
            os.kill(pid, signal.SIGKILL)
            killed += 1
        time.sleep(0.05)
    cluster.scale(2)  # its nanny may have died of it; a batch system would send others too
    run.join(300)
    assert killed == 2 and any(isinstance(error, distributed.KilledWorker) for error in given_up)
    found = aa.ReachMap(tmp_path / "a.zarr")
    assert len(found.missing) == len(whole.missing) and found.verify() == ()
    assert digest(tmp_path / "a.zarr") == digest(tmp_path / "whole.zarr")
    client.close()


def test_tiles_that_the_cluster_takes_back_are_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cluster: Any
) -> None:
    """`reach_map` raises if the cluster cancels its tiles."""
    small_tiles(monkeypatch)
    client = distributed.Client(cluster)
    plain = client.map

    def cancelled(*words: Any, **more: Any) -> Any:
        """Map, and cancel at once."""
        futures = plain(*words, **more)
        client.cancel(futures)
        return futures

    monkeypatch.setattr(client, "map", cancelled)
    with pytest.raises(aa.OutputError, match="the cluster took the tiles back: cancelled"):
        made("openarm_v10", tmp_path / "a.zarr", scheduler=client)
    client.close()
