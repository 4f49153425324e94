"""`pcnet3d batch`: every take of a study, each for itself, and one table over all."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Annotated, Any

import typer

from ....pipeline.core.cores import cores
from ....pipeline.core.device import AUTO, computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many, say
from ....pipeline.core.pose import package_version
from ....pipeline.files.atomic import (
    printable,
    read_object,
    refuse_unwritable,
    whole_file,
    write_json,
    write_rows,
    write_text,
)
from ....pipeline.plugins.options import pairs
from ....pipeline.reading.flags import Output
from ....pipeline.reading.settings import OnDevice
from ....pipeline.running.conclusion import point_to
from ....pipeline.running.progress import counted
from .executors import on_cluster, on_this_machine, outcomes_of
from .manifest import Entry, read_entries
from .page import as_page
from .study import CHANGE, Change, changes, doubts, rates_within, write_table
from .take import Job, Outcome

STATUS = "batch.json"
TABLE, PAGE, CHANGES = "study.parquet", "study.html", "changes.csv"

_LOCK = "batch.lock"
_SECONDS = 1.0  # between two writings of the status


def batch(
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
    primary: Annotated[
        str | None,
        typer.Option(
            help="Main measure, named as in changes.csv. The other measures are corrected for multiple testing."
        ),
    ] = None,
    device: OnDevice = "auto",
    outside: Annotated[
        bool, typer.Option("--outside", help="Allow paths in the manifest that lead out of its folder.")
    ] = False,
) -> None:
    """Run every take of a study and make one table of the results.

    Takes that are finished and unchanged are skipped, so the same command continues after a stop. The exit code is 2 if
    a take failed; the others are still done.
    """
    if dask and workers:
        raise InputError(
            "option-conflict", "--workers is for this machine, --dask for a cluster; give one of them."
        )
    shared = pairs(common, "--set")
    if device != AUTO:
        if "device" in shared:
            raise InputError(
                "option-conflict", "--device and --set device are the same option; give one of them."
            )
        shared = {**shared, "device": device}
    if not dask:
        with computing_on(device):  # refused now rather than by every take
            pass
    entries = read_entries(source, shared, outside)
    output = output.resolve()
    executor = on_cluster(dask) if dask else on_this_machine(workers or cores())
    with executor as running, _ours_alone(output):
        jobs = [Job(entry, output, timeout) for entry in entries]
        # Takes that failed once come last, or a batch that is often stopped would try only them.
        takes = read_object(output / STATUS).get("takes")
        known = [take for take in takes if isinstance(take, dict)] if isinstance(takes, list) else []
        failed_before = {
            str(t.get("name")) for t in known if t.get("state") == "failed" or t.get("failed_before")
        }
        in_turn = sorted(jobs, key=lambda job: job.entry.name in failed_before)
        outcomes = _run(jobs, output, outcomes_of(in_turn, running), failed_before)
        rows = study_rows(entries, outcomes)
        try:
            found, refused = changes(rows, primary), None
        except InputError as error:  # of the primary measure, for which no take need be run again
            found, refused = changes(rows), error
        _write(output, rows, found)
        if refused:
            raise refused
    failed = [outcome for outcome in outcomes if outcome.state == "failed"]
    kept = sum(outcome.state == "kept" for outcome in outcomes)
    strangers = {path.name for path in (output / "takes").iterdir() if path.name[0] != "."} - {
        e.name for e in entries
    }
    if strangers:
        say(
            "note",
            f"{how_many(len(strangers), 'take')} in {output} "
            f"{'is' if len(strangers) == 1 else 'are'} not in {source}, and not in the table",
        )
    if rates := rates_within(rows):
        say("warning", rates)
    print(
        f"{output}: {how_many(len(outcomes) - len(failed), 'take')} done ({kept} of them before), {len(failed)} failed"
    )
    done = [row for row in rows if row["state"] == "done"]
    if done:
        found = ", ".join(f"{len(doubtful)} {what}" for what, doubtful in doubts(done).items())
        print(f"of {how_many(len(done), 'run')}: {found or 'no doubts about poses or levelling'}")
    point_to(output)
    if failed:
        raise typer.Exit(2)


@contextmanager
def _ours_alone(output: Path) -> Iterator[None]:
    """The output folder, checked and locked; the system lets go of the lock when its owner ends, however that is."""
    from filelock import FileLock, Timeout

    refuse_unwritable(output)
    _check(output)
    for folder in (output / "takes", output / "logs", output / "locks"):
        folder.mkdir(parents=True, exist_ok=True)
    try:
        with FileLock(output / _LOCK, timeout=0):
            _check(output)
            for left in output.glob(".partial-*"):
                left.unlink()
            yield
    except Timeout:
        owner = read_object(output / STATUS).get("owner", "an unknown process")
        raise InputError(
            "already-there",
            f"Another batch is at work in {output}: {printable(str(owner))}; wait for it, or choose another -o.",
        ) from None


def _check(output: Path) -> None:
    """InputError when the folder is somebody else's, or of another version of ours."""
    if not output.exists():
        return
    of = read_object(output / STATUS).get("pcnet3d")
    ours = {"takes", "logs", "locks", _LOCK}
    names = {path.name for path in output.iterdir() if not path.name.startswith(".partial-")}
    if of is None and (not names <= ours or any((output / "takes").glob("[!.]*"))):
        raise InputError(
            "already-there", f"{output} holds files that no `pcnet3d batch` made; choose another -o DIR."
        )
    if of not in (None, package_version()):
        raise InputError(
            "other-version",
            f"{output} was made by pcnet3d {printable(str(of))}, this is {package_version()}, and a study must not "
            f"mix them; choose another -o DIR, or install {of} to continue this one.",
        )


def _run(
    jobs: Sequence[Job], output: Path, coming: Generator[Outcome], failed_before: set[str]
) -> list[Outcome]:
    """All outcomes in the jobs' order; the status is written as they come."""
    owner = f"process {os.getpid()} on {socket.gethostname()} since {time.strftime('%Y-%m-%d %H:%M:%S')}"
    outcomes: dict[str, Outcome] = {}
    _write_status(jobs, outcomes, failed_before, output, owner)
    written = time.monotonic()
    try:
        with counted("takes", len(jobs)) as done, closing(coming):
            for outcome in coming:
                outcomes[outcome.name] = outcome
                if outcome.state == "failed":
                    say("failed", f"{outcome.name}: {outcome.reason}")
                done(len(outcomes))
                if time.monotonic() - written > _SECONDS:
                    _write_status(jobs, outcomes, failed_before, output, owner)
                    written = time.monotonic()
    finally:
        _write_status(jobs, outcomes, failed_before, output, "")
    return [outcomes[job.entry.name] for job in jobs]


def _write_status(
    jobs: Sequence[Job], outcomes: dict[str, Outcome], failed_before: set[str], output: Path, owner: str
) -> None:
    """batch.json: whose it is, and what became of each take so far."""
    takes = []
    for name in (job.entry.name for job in jobs):
        waiting = {"name": name, "state": "waiting", "failed_before": name in failed_before}
        takes.append(outcomes[name].status if name in outcomes else waiting)
    counts = {
        state: sum(take["state"] == state for take in takes)
        for state in ("waiting", "done", "kept", "failed")
    }
    content = {"pcnet3d": package_version(), "what": "batch", "owner": owner, **counts, "takes": takes}
    write_json(output / STATUS, content)


def study_rows(entries: Sequence[Entry], outcomes: Sequence[Outcome]) -> list[dict[str, Any]]:
    """A row for every take, or for every person of a take; a failed take has one with its reason."""
    rows = []
    for entry, outcome in zip(entries, outcomes, strict=True):
        state = "failed" if outcome.state == "failed" else "done"
        head = {"name": entry.name, **entry.labels, "state": state}
        head |= {"exit_code": outcome.exit_code, "code": outcome.code, "reason": outcome.reason}
        rows += [{**head, **row} for row in outcome.rows or ({"person": ""},)]
    return rows


def _write(output: Path, rows: Sequence[dict[str, Any]], changed: Sequence[Change]) -> None:
    with whole_file(output / TABLE) as partial:
        write_table(rows, partial)
    write_rows(output / CHANGES, CHANGE, ([getattr(line, column) for column in CHANGE] for line in changed))
    write_text(output / PAGE, as_page(f"Study {output.name}", rows, changed))
