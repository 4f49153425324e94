"""How well every part does where the truth is known:  pcnet3d lab evaluate REPORT -o DIR

The one runner of all reports: it opens the networks, refuses looks at test people without a reason, asks the report,
and writes a page and the same figures as JSON. People are those that networks are chosen by, unless `--sets test` asks
for those that figures are published of. A report is a module with `rows`, which gives the values of every take and the
places where they stand, and `summary`, what becomes of all values in one place; it may have `further`, what it writes
beside. The page begins with the module's own words. REPORTS has a row for each.
"""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from datetime import date
from importlib import import_module
from inspect import getdoc
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

from typer import Argument, Option

from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.pose import package_version
from ....pipeline.files.atomic import plain, refuse_unwritable, write_json, write_text
from ....pipeline.plugins.options import did_you_mean
from ....pipeline.plugins.removed import refuse_removed
from ....pipeline.reading.settings import OnDevice
from ...lifter.load import load_lifter
from ...rectifier.load import load_rectifier
from ..beds import Bed, Configuration, Sets
from ..cases import Figure, Row, grouped

ROOT = Path(__file__).parents[3]


@dataclass(frozen=True)
class Report:
    """takes: the options that it has, besides --lifter, -o and --device. rectifiers: those that it judges where none
    are asked for, or that level the runs which it judges. bed: the cameras, where none are asked for."""

    takes: tuple[str, ...]
    rectifiers: tuple[str, ...] = ("pcnet",)
    bed: Bed = "wild"


_PEOPLE = ("seed", "sets", "because")  # before virtual cameras
_BOTH = ("geometric", "pcnet")
REPORTS = {  # by the names of their modules, with - for _
    "takes": Report(("rectifier", "bed", *_PEOPLE), _BOTH),
    "rectifiers": Report(("rectifier", "bed", *_PEOPLE), _BOTH),
    "lifter": Report(_PEOPLE, ()),
    "gait": Report(("bed", *_PEOPLE)),
    "jumps": Report(("bed", *_PEOPLE), bed="typical"),
    "repetitions": Report(("bed",), bed="typical"),
    "errors": Report((*_PEOPLE, "draws", "part", "fit", "errors")),
    "real-take": Report(()),
}


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
    asked = {name: value for name, value in locals().items() if value is not None}
    asked = {name: asked[name] for name in asked if name not in ("report", "output", "device")}
    of = _refused(report, asked)
    refuse_unwritable(output)
    reason, people = asked.pop("because", ""), asked.pop("sets", "val")
    with computing_on(device) as where:
        rectifiers = tuple(map(load_rectifier, asked.pop("rectifier", of.rectifiers)))
        configuration = Configuration(people, rectifiers=rectifiers, **{"bed": of.bed, **asked})
        methods = [load_lifter(configuration.lifter).method, *(each.method for each in rectifiers)]
        for each_set in configuration.sets if "sets" in of.takes else ():
            each_set.clips()  # a set without takes is refused before the work
        tables = measured(report, configuration, output)
    networks = [method for method in methods if "@" in method]
    judged = {"judged": people} if "sets" in of.takes else {}
    heading = [name for name in ("lifter", "seed", "bed", "draws") if name in (*of.takes, "lifter")]
    results = {"report": report, **judged, "pcnet3d": package_version()}
    results |= {name: getattr(configuration, name) for name in heading} | tables
    results |= {"networks": networks, "date": date.today().isoformat(), "device": where.summary()}
    if reason:
        note_look(output, f"pcnet3d lab evaluate {report} --sets {people}", networks, reason)
    publish(output / "evaluation", report, getdoc(_module(report)) or "", results)


def _refused(report: str, given: dict[str, Any]) -> Report:
    """The report, unless InputError for one that there is not, an option that it does not take, test people without a
    reason, or a reason without them."""
    if report not in REPORTS:
        refuse_removed("reports", report)
        raise InputError("name-unknown", f"There is no report '{report}'; {did_you_mean(report, REPORTS)}")
    of = REPORTS[report]
    takes = ("lifter", *of.takes)
    if strange := [name for name in given if name not in takes]:
        raise InputError(
            "option-conflict",
            f"The report {report} has no --{strange[0]}, only --{', --'.join(takes)}; leave it out.",
        )
    refuse_unexplained(given.get("sets", "val"), given.get("because", ""))
    return of


def _module(report: str) -> ModuleType:
    return import_module(f".{report.replace('-', '_')}", __package__)


def measured(report: str, asked: Configuration, output: Path) -> dict[str, Any]:
    """A report's nested figures, of counts the sum; what it writes beside goes into the folder output."""
    module = _module(report)
    values = grouped(module.rows(asked))
    output.mkdir(parents=True, exist_ok=True)
    figures = {keys: sum(of) if isinstance(of[0], int) else module.summary(of) for keys, of in values.items()}
    if hasattr(module, "further"):
        figures |= module.further(asked, output, values)
    results: dict[str, Any] = {}
    for (*above, last), of in figures.items():
        place = results
        for key in above:
            place = place.setdefault(key, {})
        place[last] = of
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
        places = rows_of(of) if isinstance(of, Mapping) and name != "device" else ()
        tables = grouped(
            ((len(keys), *figures), [*keys, *map(_cell, figures.values())]) for keys, figures in places
        )
        for (deep, *columns), lines in tables.items():
            head = [name, *[""] * (deep - 1), *columns] if deep else columns
            parts.append("\n".join(f"| {' | '.join(line)} |" for line in [head, ["---"] * len(head), *lines]))
    return "\n\n".join(part for part in parts if part) + "\n"


def rows_of(of: Mapping[str, Any], keys: tuple[str, ...] = ()) -> Iterator[Row]:
    """(keys, figures) of every place in which figures stand."""
    if figures := {key: value for key, value in of.items() if not isinstance(value, Mapping)}:
        yield keys, figures
    for key, value in of.items():
        if isinstance(value, Mapping):
            yield from rows_of(value, (*keys, key))


def _cell(value: Any) -> str:
    if value is None or value != value:  # NaN
        return ""
    if isinstance(value, Figure):
        return " / ".join(f"{each:.3g}" for each in astuple(value))
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
    lines = [(date.today().isoformat(), command, " ".join(networks), " ".join(because.split()))]
    if not path.exists():
        lines.insert(0, ("date", "command", "networks", "because"))
    with open(path, "a", newline="", encoding="utf-8") as file:
        csv.writer(file, lineterminator="\n").writerows(lines)
