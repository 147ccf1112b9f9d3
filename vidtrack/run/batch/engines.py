"""What does the tasks: the cores of this machine, or those of a Dask cluster. Both call the same function."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vidtrack.errors import ConfigError, StoppedEarly
from vidtrack.run.batch.child import end_children
from vidtrack.run.batch.task import VERSION

if TYPE_CHECKING:
    from distributed import Client

_ANSWER_S = 10.0
"""Time in which a scheduler has to answer."""
_LOCAL = "local"
_ROOM = 2
"""Tasks handed over for each core: enough that none waits, few enough that seams and retries come soon."""


@dataclass(frozen=True, slots=True)
class Engine:
    """Does tasks.

    executor   takes the function and a task
    shown      what it is, in words
    width      returns the number of tasks to hand over at a time
    end        ends the processes that work for a place
    check      raises StoppedEarly if the engine is gone
    """

    executor: Executor
    shown: str
    width: Callable[[], int]
    end: Callable[[str], None]
    check: Callable[[], None]


def cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@contextmanager
def engine(dask: str | None, workers: int | None) -> Iterator[Engine]:
    """The engine that is asked for.

    dask     "local", the address of a scheduler, or its file; None: this machine without Dask
    workers  number of cores to use on this machine; None: all

    Raises ConfigError without Dask, for a scheduler that does not answer, and for workers of another version.
    """
    if dask is None:
        with _threads(workers or cores()) as found:
            yield found
    else:
        with _dask(dask, workers or cores()) as found:
            yield found


@contextmanager
def _threads(workers: int) -> Iterator[Engine]:
    """A thread for each core; each keeps one process."""
    executor = ThreadPoolExecutor(workers, thread_name_prefix="batch")
    try:
        yield Engine(
            executor, f"{workers} {'core' if workers == 1 else 'cores'}", lambda: _ROOM * workers, end_children, _alive
        )
    finally:
        executor.shutdown(cancel_futures=True)


def _alive() -> None:
    """This process does not go away."""


@contextmanager
def _dask(where: str, workers: int) -> Iterator[Engine]:
    if find_spec("distributed") is None:
        raise ConfigError("--dask needs Dask: pip install 'vidtrack[dask]'; without --dask all cores are used")
    with _cluster(where, workers) as client:
        _same_version(client)

        def check() -> None:
            if client.status not in ("running", "connecting"):
                raise StoppedEarly(f"the scheduler {shown} is gone; run the same command again to go on")

        shown = client.scheduler.address if client.scheduler else where
        yield Engine(
            client.get_executor(pure=False, retries=0),
            f"Dask at {shown}, dashboard {client.dashboard_link}",
            lambda: _ROOM * max(1, sum(client.nthreads().values())) if client.status == "running" else 0,
            lambda out: _end_all(client, out),
            check,
        )


@contextmanager
def _cluster(where: str, workers: int) -> Iterator[Client]:
    """A client of the cluster that is asked for; one of its own is closed at the end."""
    from distributed import Client, LocalCluster

    for name in ("distributed", "distributed.client", "tornado"):  # what concerns the user is raised
        logging.getLogger(name).setLevel(logging.CRITICAL)
    if where == _LOCAL:
        cluster = LocalCluster(
            n_workers=workers, threads_per_worker=1, processes=False, dashboard_address="127.0.0.1:0", silence_logs=50
        )
        with cluster, Client(cluster) as client:
            yield client
        return
    if "://" not in where and not Path(where).is_file():
        raise ConfigError(f"--dask {where}: give local, tcp://HOST:PORT, or the file that a scheduler wrote")
    try:
        client = Client(where, timeout=_ANSWER_S) if "://" in where else Client(scheduler_file=where, timeout=_ANSWER_S)
    except (OSError, TimeoutError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ConfigError(f"the scheduler {where} does not answer: {reason}") from None
    with client:
        yield client


def _same_version(client: Client) -> None:
    """Raise ConfigError if a worker has another version of vidtrack, or none."""
    found = client.run(worker_version, on_error="return")
    for worker, version in found.items():
        if version != VERSION:
            has = "no vidtrack" if isinstance(version, Exception) else f"vidtrack {version}"
            raise ConfigError(f"the worker {worker} has {has}, this is {VERSION}; install the same version on all")


def worker_version() -> str:
    """The version of vidtrack where this is called."""
    return VERSION


def _end_all(client: Any, out: str) -> None:
    """End what runs for a place on all workers; a scheduler that is gone cannot be told."""
    if client.status == "running":
        with suppress(OSError, TimeoutError, RuntimeError):
            client.run(end_children, out, on_error="ignore")
