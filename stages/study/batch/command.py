"""`pcnet3d batch`: every take of a study, each for itself, and one table over all."""

from __future__ import annotations

from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import CancelledError, Executor, ThreadPoolExecutor, as_completed
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from ....pipeline.core.device import AUTO, computing_on
from ....pipeline.core.errors import InputError, needed_for
from ....pipeline.core.messages import say
from ....pipeline.core.pose import package_version
from ....pipeline.core.system import cores
from ....pipeline.files.atomic import printable, read_object, refuse_unwritable, write_json, write_text
from ....pipeline.plugins.options import pairs
from ....pipeline.reading.settings import Output, RunOptions, offering
from ....pipeline.running.progress import counted
from ....pipeline.running.sentences import point_to
from .manifest import Entry, read_entries
from .study import as_page, concluded, write_table
from .take import Outcome, end_takes, run_take

MARK, TABLE, PAGE = "batch.json", "study.parquet", "study.html"

_PATIENCE_S = 60.0  # for a cluster that has no worker


@offering("fps", "device")
def batch(
    options: RunOptions,
    source: Annotated[
        Path,
        typer.Argument(
            help="A manifest (CSV file whose columns are options of `run`), or a folder of takes."
        ),
    ],
    output: Output,
    workers: Annotated[
        int | None, typer.Option(min=1, help="How many takes run at once; by default one per core.")
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler; its workers run the takes instead of this machine."),
    ] = None,
    timeout: Annotated[
        float | None, typer.Option(min=1, help="Stop a take after this many seconds; by default never.")
    ] = None,
    common: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="OPTION=VALUE of `run`, or STAGE.KEY=VALUE, for every take whose row does not set it; repeatable.",
        ),
    ] = None,
) -> None:
    """Run every take of a study and make one table of the results.

    Takes that are finished and unchanged are skipped, so the same command continues after a stop. The exit code is 2 if
    a take failed; the others are still done.
    """
    if dask and workers:
        raise InputError(
            "option-conflict", "--workers is for this machine, --dask for a cluster; give one of them."
        )
    if not dask:
        with computing_on(options.device):  # refused now rather than by every take
            pass
    entries = read_entries(source, _for_all(options, common))
    output = output.resolve()
    executor = on_cluster(dask) if dask else on_this_machine(workers or cores())
    with executor as running:
        _prepare(output)
        outcomes = _run(entries, output, running, timeout)
        rows = study_rows(entries, outcomes)
        write_table(rows, output / TABLE)
        write_text(output / PAGE, as_page(f"Study {output.name}", rows))
    said, *trusted = concluded(rows, sum(each.state == "kept" for each in outcomes))
    print("\n".join([f"{output}: {said}", *trusted]))
    point_to(output)
    if any(each.state == "failed" for each in outcomes):
        raise typer.Exit(2)


def _for_all(options: RunOptions, common: list[str] | None) -> dict[str, str]:
    """The options that every take gets that does not set them itself."""
    shared = pairs(common, "--set")
    given = {"fps": options.fps, "device": None if options.device == AUTO else options.device}
    for name, value in given.items():
        if value is not None and name in shared:
            raise InputError(
                "option-conflict", f"--{name} and --set {name} are the same option; give one of them."
            )
        shared |= {} if value is None else {name: str(value)}
    return shared


@contextmanager
def on_this_machine(workers: int) -> Iterator[Executor]:
    """So many takes at a time. The threads only wait: each take has a process of its own."""
    with ThreadPoolExecutor(workers) as executor:
        try:
            yield executor
        except BaseException:
            executor.shutdown(wait=False, cancel_futures=True)
            end_takes()
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


def outcomes_of(
    entries: Sequence[Entry], output: Path, executor: Executor, timeout_s: float | None = None
) -> Generator[Outcome]:
    """Of all takes, as they come. InputError when the executor is lost; what is done then is kept."""
    version = package_version()
    names = {executor.submit(run_take, entry, output, version, timeout_s): entry.name for entry in entries}
    try:
        for future in as_completed(names):
            try:
                outcome = future.result()
            except CancelledError:
                raise InputError(
                    "not-reached",
                    "The Dask scheduler was lost; takes that are done are kept, run the same command again when it is "
                    "back.",
                ) from None
            except Exception as error:  # whatever a cluster says of workers that died one after another
                reason = str(error).partition("\n")[0]
                reason = f"its workers failed: {type(error).__name__}: {reason}"
                outcome = Outcome(names[future], "failed", 1, reason)
            yield outcome
    finally:
        for future in names:
            future.cancel()


def _prepare(output: Path) -> None:
    """The output folder with its mark. InputError when it is somebody else's, or of another version of ours."""
    refuse_unwritable(output)
    made_by = read_object(output / MARK).get("pcnet3d")
    entries = output.iterdir() if output.exists() else ()
    if made_by is None and any(
        not path.name.startswith(".partial-") for path in entries
    ):  # of a batch that was killed
        raise InputError(
            "already-there", f"{output} holds files that no `pcnet3d batch` made; choose another -o DIR."
        )
    if made_by not in (None, package_version()):
        raise InputError(
            "other-version",
            f"{output} was made by pcnet3d {printable(str(made_by))}, this is {package_version()}, and a study must "
            f"not mix them; choose another -o DIR, or install {made_by} to continue this one.",
        )
    output.mkdir(parents=True, exist_ok=True)
    write_json(output / MARK, {"pcnet3d": package_version(), "what": "batch"})
    for folder in ("takes", "logs", "locks"):
        (output / folder).mkdir(exist_ok=True)


def _run(
    entries: Sequence[Entry], output: Path, executor: Executor, timeout_s: float | None
) -> list[Outcome]:
    """All outcomes in the entries' order, those that failed said as they come."""
    outcomes: dict[str, Outcome] = {}
    with (
        counted("takes", len(entries)) as done,
        closing(outcomes_of(entries, output, executor, timeout_s)) as coming,
    ):
        for outcome in coming:
            outcomes[outcome.name] = outcome
            if outcome.state == "failed":
                say("failed", f"{outcome.name}: {outcome.reason}")
            done(len(outcomes))
    return [outcomes[entry.name] for entry in entries]


def study_rows(entries: Sequence[Entry], outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """A row for every take, or for every person of a take; a failed take has one with its reason."""
    rows = []
    for entry, outcome in zip(entries, outcomes, strict=True):
        state = "failed" if outcome.state == "failed" else "done"
        head = {"name": entry.name, **entry.labels, "state": state}
        head |= {"exit_code": outcome.exit_code, "code": outcome.code, "reason": outcome.reason}
        rows += [{**head, **row} for row in outcome.rows or ({"person": ""},)]
    return rows
