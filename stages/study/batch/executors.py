"""Where the takes of a batch run: on this machine, or on a Dask cluster; the same function on either."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any

from ....pipeline.core.errors import InputError
from ....pipeline.core.extras import needed_for
from .process import ending_takes
from .take import Job, Outcome, run_take

_PATIENCE_S = 60.0  # for a cluster that has no worker


def outcomes_of(jobs: Sequence[Job], executor: Executor) -> Generator[Outcome]:
    """Of all jobs, as they come. InputError when the executor is lost; what is done then is kept."""
    names = {executor.submit(run_take, job): job.entry.name for job in jobs}
    try:
        for future in as_completed(names):
            yield _outcome(future, names[future])
    finally:
        for future in names:
            future.cancel()


def _outcome(future: Future[Outcome], name: str) -> Outcome:
    try:
        return future.result()
    except CancelledError:
        raise InputError(
            "not-reached",
            "The Dask scheduler was lost; takes that are done are kept, run the same command again when it is back.",
        ) from None
    except Exception as error:  # whatever a cluster says of workers that died one after another
        reason = str(error).partition("\n")[0]
        return Outcome(name, "failed", 1, f"its workers failed: {type(error).__name__}: {reason}")


@contextmanager
def on_this_machine(workers: int) -> Iterator[Executor]:
    """So many takes at a time. The threads only wait: each take has a process of its own."""
    with ThreadPoolExecutor(workers) as executor, ending_takes():
        try:
            yield executor
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            raise


@contextmanager
def on_cluster(address: str, patience_s: float = _PATIENCE_S) -> Iterator[Executor]:
    """The workers of the Dask scheduler at that address. One that is lost costs nothing but time: its takes go to
    another one, and those it had finished are found done. InputError when there is no scheduler, or it has no worker
    within `patience_s`."""
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
        client.wait_for_workers(1, timeout=patience_s)
        yield client.get_executor(pure=False)
    except TimeoutError:
        raise InputError(
            "not-reached",
            f"The cluster at {address} has had no worker for {patience_s:g} s; run the same command again when it has "
            "some.",
        ) from None
    finally:
        client.close(timeout=5)
