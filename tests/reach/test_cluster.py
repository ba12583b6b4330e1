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
from support.maps import ARMS, digest, made, small_tiles
from support.needs import need

import armangle as aa

need("zarr")
distributed = need("distributed")


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """One worker, in a process of its own, started again when it dies."""
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs=50
    ) as running:
        yield running


@pytest.mark.parametrize("name", ARMS)
def test_a_cluster_writes_the_bytes_that_threads_write(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cluster: Any
) -> None:
    small_tiles(monkeypatch)
    made(name, tmp_path / "whole.zarr")
    told: list[tuple[int, int]] = []
    found = made(
        name, tmp_path / "a.zarr", scheduler=cluster.scheduler_address, progress=lambda *now: told.append(now)
    )
    assert found.missing == () and told[-1] == (found.tiles, found.tiles)
    assert digest(tmp_path / "a.zarr") == digest(tmp_path / "whole.zarr")


def test_a_worker_killed_four_times_on_one_tile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cluster: Any
) -> None:
    """Dask gives a task up then; the tile is asked for again."""
    small_tiles(monkeypatch, 2**23)
    options: dict[str, Any] = {"spacing": 0.024, "tilt": 0.05}
    whole = made("human_arm_left", tmp_path / "whole.zarr", part=(1, 2), **options)
    given_up: list[BaseException] = []
    client = distributed.Client(cluster)
    plain = client.map

    def watched(*words: Any, **more: Any) -> Any:
        futures = plain(*words, **more)
        for future in futures:
            future.add_done_callback(lambda f: f.status == "error" and given_up.append(f.exception()))
        return futures

    monkeypatch.setattr(client, "map", watched)
    run = threading.Thread(
        target=made, args=("human_arm_left", tmp_path / "a.zarr"),
        kwargs={"part": (1, 2), "scheduler": client, **options},
    )  # fmt: skip
    run.start()
    killed = 0
    deadline = time.monotonic() + 90
    while run.is_alive() and killed < 4 and time.monotonic() < deadline:
        busy = [address for address, tasks in client.processing().items() if tasks]
        pids = client.run(os.getpid) if busy else {}
        for pid in pids.values():
            os.kill(pid, signal.SIGKILL)
            killed += 1
        time.sleep(0.05)
    run.join(90)
    assert killed == 4 and any(isinstance(error, distributed.KilledWorker) for error in given_up)
    found = aa.ReachMap(tmp_path / "a.zarr")
    assert len(found.missing) == len(whole.missing) and found.verify() == ()
    assert digest(tmp_path / "a.zarr") == digest(tmp_path / "whole.zarr")
    client.close()
