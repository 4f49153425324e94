"""Where the takes of a batch run: on this machine, or on a Dask cluster; the same function on either."""

from __future__ import annotations

import time
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any

from ....pipeline.core.errors import InputError
from ....pipeline.core.extras import needed_for
from .take import Job, Outcome, run_take
from .workers import close_workers, stop_takes

_LOOK_S = 0.1


def on_this_machine(jobs: Sequence[Job], workers: int) -> Generator[Outcome]:
    """Outcomes as they come. The threads only wait: each has a process that runs its takes."""
    with ThreadPoolExecutor(workers) as pool:
        try:
            for future in as_completed([pool.submit(run_take, job) for job in jobs]):
                yield future.result()
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            stop_takes()
            raise
        finally:
            close_workers()


@contextmanager
def connected(address: str) -> Iterator[Any]:
    """A client of the Dask scheduler at that address; InputError when there is none."""
    import logging

    with needed_for("--dask", "dask"):
        from distributed import Client
    # What matters of its log is said here in a sentence.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client: Any = Client(address, timeout=10)
    except (OSError, ValueError, TypeError, ImportError) as error:
        raise InputError(
            "not-reached",
            f"There is no Dask scheduler to be reached at {address} ({type(error).__name__}); expected an address such "
            "as tcp://HOST:8786.",
        ) from None
    try:
        yield client
    finally:
        client.close(timeout=5)


def on_cluster(jobs: Sequence[Job], client: Any, patience_s: float = 60.0) -> Generator[Outcome]:
    """Outcomes as they come, from the workers of a client's cluster.

    A worker that is lost costs nothing but time: its takes go to another one, and those it had finished are found
    done. InputError when the cluster is lost, or has no worker for `patience_s`.
    """
    from distributed import as_completed as ready

    address = client.scheduler.address
    futures = client.map(run_take, jobs, pure=False)
    try:
        names = {future.key: job.entry.name for future, job in zip(futures, jobs, strict=True)}
        waiting = ready(futures)
        seen = time.monotonic()
        while not waiting.is_empty():
            batch = waiting.next_batch(block=False)
            for future in batch:
                if future.status in ("lost", "pending"):  # its answer was on a worker that has died since
                    waiting.add(future)
                else:
                    yield _outcome(future, names[future.key], address)
            if batch or _has_workers(client, address):
                seen = time.monotonic()
            elif time.monotonic() - seen > patience_s:
                raise InputError(
                    "not-reached",
                    f"The cluster at {address} has had no worker for {patience_s:g} s; "
                    "takes that are done are kept, run the same command again when it has some.",
                )
            if not batch:
                time.sleep(_LOOK_S)
    finally:
        client.cancel(futures)


def _has_workers(client: Any, address: str) -> bool:
    try:
        if client.status == "running":
            return bool(client.nthreads())
    except OSError:
        pass
    raise _lost(address)


def _outcome(future: Any, name: str, address: str) -> Outcome:
    if future.status == "finished":
        return future.result()
    if future.status == "error":
        error = future.exception()
        reason = str(error).partition("\n")[0]
        return Outcome(name, "failed", 1, f"its workers failed: {type(error).__name__}: {reason}")
    raise _lost(address)


def _lost(address: str) -> InputError:
    return InputError(
        "not-reached",
        f"The Dask scheduler at {address} was lost; takes that are done are kept, run the same "
        "command again when it is back.",
    )
