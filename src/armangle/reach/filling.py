"""Computation of a map's tiles: threads of this process, or the workers of a Dask cluster."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from typing import Any

from .._progress import Progress
from .._threads import thread_count
from ..errors import InputError, OutputError, needed
from .store import Store

_VAIN_ROUNDS = 10  # rounds of a cluster without a finished tile before giving up


def fill_tile(place: str, tile: int) -> None:
    """Compute one tile of the map at a place; a worker imports and runs this."""
    Store(place).fill(tile)


def fill_here(store: Store, tiles: Sequence[int], progress: Progress | None) -> None:
    """Compute and write tiles in threads (see `set_threads`; or one a core); remove dead writers' files."""
    began, done = time.time(), 0
    pool = ThreadPoolExecutor(thread_count(0) or os.cpu_count() or 1)
    try:
        for future in as_completed([pool.submit(store.fill, tile) for tile in tiles]):
            future.result()
            done += 1
            if progress is not None:
                progress(done, len(tiles))
    finally:
        pool.shutdown(cancel_futures=True)
    store.sweep(began)


def check_scheduler(scheduler: Any) -> None:
    """Raise unless it is the address of a Dask scheduler or a Dask client."""
    address = isinstance(scheduler, str) and "://" in scheduler
    if not address and not all(hasattr(scheduler, name) for name in ("map", "scheduler_info")):
        wanted = "a distributed.Client, or an address such as tcp://host:8786"
        raise InputError(f"scheduler is {scheduler!r:.50}, wanted {wanted}")


def fill_on_cluster(store: Store, tiles: Sequence[int], scheduler: Any, progress: Progress | None) -> None:
    """Compute tiles with the workers of a Dask cluster, until none is missing.

    Dask gives up a task when four of its workers have died, as happens when a batch system's time ends. Such
    tasks are submitted again: a tile has no memory of earlier attempts.
    """
    distributed = needed("distributed", "a scheduler needs", "cluster")
    given = isinstance(scheduler, distributed.Client)
    client = scheduler if given else distributed.Client(scheduler)
    began, wanted, left, vain = time.time(), len(tiles), list(tiles), 0
    try:
        while left:
            futures = client.map(fill_tile, [store.place] * len(left), left, pure=False)
            finished = 0
            for future in distributed.as_completed(futures, raise_errors=False):
                if future.status == "finished":
                    finished += 1
                    if progress is not None:
                        progress(wanted - len(left) + finished, wanted)
                elif future.status != "error":
                    raise OutputError(f"{store.place}: the cluster took the tiles back: {future.status}")
                elif not isinstance(future.exception(), distributed.KilledWorker):
                    raise future.exception()
            still = set(store.missing())
            left = [tile for tile in left if tile in still]
            vain = 0 if finished else vain + 1
            if vain == _VAIN_ROUNDS:
                raise OutputError(f"{store.place}: workers die before a tile is done, {vain} rounds long")
    finally:
        if not given:
            client.close()
    store.sweep(began)
