"""How well every part does where the truth is known:  pcnet3d lab evaluate REPORT -o DIR

The one runner of all reports: it opens the networks, refuses looks at test people without a reason, asks the report,
and writes a page and the same figures as JSON. People are those that networks are chosen by, unless `--sets test` asks
for those that figures are published of. A report is a module with `rows`, which gives the values of every take and the
places where they stand, and `summary`, what becomes of all values in one place; or with `tables` in place of both,
where a fit needs all values at once. The page begins with the module's own words. REPORTS has a row for each.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from datetime import date
from importlib import import_module
from inspect import getdoc
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.pose import package_version
from ....pipeline.files.atomic import refuse_unwritable, write_json, write_text
from ....pipeline.plugins.options import did_you_mean
from ....pipeline.plugins.removed import refuse_removed
from ....pipeline.reading.settings import OnDevice
from ...common.metrics import plain
from ...lifter.load import load_lifter
from ...rectifier.load import load_rectifier
from ..common.metrics import Figure, Row
from .runs import Configuration, Sets
from .testbed import Bed

ROOT = Path(__file__).parents[3]
_LEDGER = ("date", "command", "networks", "because")


@dataclass(frozen=True)
class Report:
    """takes: the options that it has, besides -o and --device. runs: whether it judges whole runs, which the shipped
    rectifier levels. bed: the cameras, where none are asked for."""

    takes: tuple[str, ...]
    runs: bool = False
    bed: Bed = "wild"


_VIRTUAL = ("lifter", "seed", "bed", "sets", "because")  # of people before virtual cameras
REPORTS = {  # by the names of their modules, with - for _
    "takes": Report(("rectifier", *_VIRTUAL)),
    "rectifiers": Report(("rectifier", *_VIRTUAL)),
    "lifter": Report(("lifter", "seed", "sets", "because")),
    "gait": Report(_VIRTUAL, runs=True),
    "jumps": Report(_VIRTUAL, runs=True, bed="typical"),
    "verdicts": Report(_VIRTUAL, runs=True),
    "repetitions": Report(("lifter", "bed"), runs=True, bed="typical"),
    "errors": Report(("lifter", "seed", "sets", "because", "draws", "part", "fit", "errors"), runs=True),
    "real-take": Report(("lifter",), runs=True),
}
_RECTIFIERS = ("geometric", "pcnet")


def evaluate(
    report: Annotated[str, Argument(help=f"What to test: {', '.join(REPORTS)}.")],
    output: Annotated[Path, Option("-o", "--output", help="Folder for the report, .md and .json.")],
    lifter: Annotated[str | None, Option(help="A name, or an .onnx file.")] = None,
    rectifier: Annotated[list[str] | None, Option(help="A name or an .onnx file; repeatable.")] = None,
    sets: Annotated[Sets | None, Option(help="Validation people, or others, with --because.")] = None,
    because: Annotated[str | None, Option(help="Why test people are looked at; goes to the ledger.")] = None,
    bed: Annotated[Bed | None, Option(help="Cameras: from everywhere, or as people film.")] = None,
    seed: Annotated[int | None, Option(min=0, help="Random seed.")] = None,
    draws: Annotated[int | None, Option(min=1, help="errors: so many seeds from --seed on.")] = None,
    part: Annotated[list[str] | None, Option(help="errors: a configuration alone; repeatable.")] = None,
    fit: Annotated[bool | None, Option("--fit", help="errors: fit them to DIR/joint_noise.json.")] = None,
    errors: Annotated[Path | None, Option(help="errors: of angles, as --fit writes them.")] = None,
    device: OnDevice = "auto",
) -> None:
    """Test lifters, rectifiers and later stages where the truth is known."""
    given = {name: value for name, value in locals().items() if value is not None}
    given = {name: given[name] for name in given if name not in ("report", "output", "device")}
    of = _refused(report, given)
    refuse_unwritable(output)
    module = import_module(f".{report.replace('-', '_')}", __package__)
    reason, people = given.pop("because", ""), given.pop("sets", "val")
    further = {name: given.pop(name) for name in ("draws", "part", "fit") if name in given}
    with computing_on(device) as where:
        named = given.pop("rectifier", _RECTIFIERS) if "rectifier" in of.takes else ()
        rectifiers = tuple(map(load_rectifier, named))
        asked = Configuration(people, rectifiers=rectifiers, **{"bed": of.bed, **given})
        for each_set in asked.sets if "sets" in of.takes else ():
            each_set.clips()  # a set without takes is refused before the work
        if hasattr(module, "tables"):
            tables = module.tables(asked, output, **further)
        else:
            tables = tabled(module.rows(asked), module.summary)
        methods = [load_lifter(asked.lifter).method] if "lifter" in of.takes else []
        methods += [each.method for each in (rectifiers or [load_rectifier("pcnet")] * of.runs)]
    networks = [method for method in methods if "@" in method]
    judged = {"judged": people} if "sets" in of.takes else {}
    heading = {name: getattr(asked, name) for name in ("lifter", "seed", "bed") if name in of.takes}
    results = {"report": report, **judged, "pcnet3d": package_version(), **heading, **tables}
    results |= {"networks": networks, "date": date.today().isoformat(), "device": where.summary()}
    output.mkdir(parents=True, exist_ok=True)
    if reason:
        note_look(output, f"pcnet3d lab evaluate {report} --sets {people}", networks, reason)
    publish(output / "evaluation", report, getdoc(module) or "", results)


def _refused(report: str, given: dict[str, Any]) -> Report:
    """The report, unless InputError for one that there is not, an option that it does not take, test people without a
    reason, or a reason without them."""
    if report not in REPORTS:
        refuse_removed("reports", report)
        raise InputError("name-unknown", f"There is no report '{report}'; {did_you_mean(report, REPORTS)}")
    of = REPORTS[report]
    if strange := [name for name in given if name not in of.takes]:
        raise InputError(
            "option-conflict",
            f"The report {report} has no --{strange[0]}, only --{', --'.join(of.takes)}; leave it out.",
        )
    refuse_unexplained(given.get("sets", "val"), given.get("because", ""))
    return of


def tabled(rows: Iterable[Row], summary: Callable[[list[Any]], Any]) -> dict[str, Any]:
    """Nested figures: at each place what becomes of all its values: the sum of counts, else what `summary` says of
    them."""
    values: dict[tuple[str, ...], list[Any]] = {}
    for keys, value in rows:
        values.setdefault(keys, []).append(value)
    results: dict[str, Any] = {}
    for (*above, last), of in values.items():
        place = results
        for key in above:
            place = place.setdefault(key, {})
        place[last] = sum(of) if isinstance(of[0], int) else summary(of)
    return results


def publish(file: Path, title: str, about: str, results: dict[str, Any]) -> None:
    """Write and print a report: its page, `file` with .md, and its figures, with .json."""
    text = written(results, title, about)
    write_text(file.with_suffix(".md"), text)
    write_json(file.with_suffix(".json"), plain(results))
    print(text)


def written(results: Mapping[str, Any], title: str, about: str) -> str:
    """A report's nested figures as a page of Markdown tables: a table for all figures that stand alike, a row for each
    place they stand in, its keys in front. about: what stands above the tables; what the report was asked stands before
    it."""
    said = {name: value for name, value in results.items() if not isinstance(value, Mapping | list)}
    parts = [f"# {title}", ", ".join(f"{name} {_cell(value)}" for name, value in said.items()), about]
    for name, of in results.items():
        tables: dict[tuple[int, tuple[str, ...]], list[list[str]]] = {}
        for keys, figures in rows_of(of) if isinstance(of, Mapping) and name != "device" else ():
            line = [*keys, *map(_cell, figures.values())]
            tables.setdefault((len(keys), tuple(figures)), []).append(line)
        for (deep, columns), lines in tables.items():
            head = [name, *[""] * (deep - 1), *columns] if deep else list(columns)
            parts.append("\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *lines]))
    return "\n\n".join(part for part in parts if part) + "\n"


def rows_of(of: Mapping[str, Any], keys: tuple[str, ...] = ()) -> Iterator[Row]:
    """(keys, figures) of every place in which figures stand; of `pooled` ones what they say in words."""
    said = {key: value.get("said") if isinstance(value, Mapping) else value for key, value in of.items()}
    further = {key: value for key, value in of.items() if isinstance(value, Mapping) and "said" not in value}
    if figures := {key: value for key, value in said.items() if key not in further}:
        yield keys, figures
    for key, value in further.items():
        yield from rows_of(value, (*keys, str(key)))


def _cell(value: Any) -> str:
    if value is None or value != value:  # NaN
        return ""
    if isinstance(value, Figure):
        return " / ".join(f"{each:.3g}" for each in astuple(value))
    if isinstance(value, list | tuple):
        return ", ".join(map(_cell, value))
    return (
        f"{value:,}" if isinstance(value, int) else f"{value:.3g}" if isinstance(value, float) else str(value)
    )


def refuse_unexplained(sets: Sets, because: str) -> None:
    """InputError for test people without a reason, and a reason without them."""
    if (sets != "val") != bool(because.strip()):
        raise InputError(
            "needs-input",
            "Test subjects are looked at rarely: give --because REASON with --sets test, cmu or tennis, and only then.",
        )


def note_look(output: Path, command: str, networks: Sequence[str], because: str) -> None:
    """Append a line to the ledger of looks at the test sets, for who is looked at often is no test any more: the day,
    the command, the networks with their digests, and why. It is docs/accuracy/ledger.csv where this package lies in its
    repository, else ledger.csv in the report's folder."""
    path = (ROOT / "docs" / "accuracy" if (ROOT / ".git").exists() else output) / "ledger.csv"
    line = date.today().isoformat(), command, " ".join(networks), " ".join(because.split())
    first = not path.exists()
    with open(path, "a", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows([_LEDGER, line] if first else [line])
