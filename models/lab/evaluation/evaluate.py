"""How well every part does where the truth is known:  pcnet3d lab evaluate REPORT -o DIR

A subcommand a report; each writes a page and the same figures as JSON. People are those that networks are chosen by,
unless `--sets test` asks for those that figures are published of. A report is a module with `tables`, which answers a
Question with nested figures, and `PAGE`, what the page says of them.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from datetime import date
from importlib import import_module
from inspect import Parameter, Signature, signature
from pathlib import Path
from typing import Annotated, Any

import typer

from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.files.atomic import refuse_unwritable, write_json, write_text
from ....pipeline.reading.settings import OnDevice
from ...common.metrics import plain
from ...lifter.load import load_lifter
from ...rectifier.load import load_rectifier
from ..synthetic.views import Targets
from .sets import Question, Sets
from .tables import written
from .testbed import Bed

evaluate = typer.Typer(help="Test lifters, rectifiers and later stages where the truth is known.")

ROOT = Path(__file__).parents[3]
_LEDGER = ("date", "command", "networks", "because")
_BOTH = ["geometric", "pcnet"]


def _asked(
    networks: Annotated[list[str], typer.Argument(help="pcnet3d (built-in), or .onnx files of lifters.")],
    data: Annotated[Path, typer.Argument(help="Motion capture, a file of pcnet3d lab mocap.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the report, .md and .json.")],
    rectifier: Annotated[
        list[str], typer.Option(help="A rectifier, or a network's .onnx file; repeatable.")
    ] = _BOTH,
    split: Annotated[
        Path | None, typer.Option(help="JSON file whose `test` lists the test people; by default all.")
    ] = None,
    targets: Annotated[
        Targets, typer.Option(help="True axes: gravity and heading (body), or the file's (axes).")
    ] = "body",
    lifter: Annotated[str, typer.Option(help="pcnet3d (built-in), or an .onnx file.")] = "pcnet3d",
    seed: Annotated[int, typer.Option(min=0, help="Random seed.")] = 0,
    seeds: Annotated[int, typer.Option(min=1, help="How many random seeds to draw cameras from.")] = 3,
    part: Annotated[
        list[str] | None,
        typer.Option(help='Only this part, such as "CMU val"; for `errors` also "real take"; repeatable.'),
    ] = None,
    bed: Annotated[
        Bed,
        typer.Option(
            help="Cameras: wild (also steep, tilted, with long lenses) or typical (as people film)."
        ),
    ] = "wild",
    sets: Annotated[
        Sets,
        typer.Option(
            help="People to test on: validation people (val), or test people, which need --because."
        ),
    ] = "val",
    because: Annotated[
        str,
        typer.Option(
            help="Reason for a look at test people; it is added to docs/accuracy/ledger.csv, or to DIR."
        ),
    ] = "",
    fit: Annotated[
        bool, typer.Option("--fit", help="Also fit angle errors and write DIR/joint_noise.json.")
    ] = False,
    answers: Annotated[
        Path | None,
        typer.Option(help="Test the poses in this folder, by another lifter from testbed --keypoints."),
    ] = None,
    errors: Annotated[
        Path | None, typer.Option(help="Test the angle errors in this file, as --fit writes it.")
    ] = None,
    device: OnDevice = "auto",
) -> None:
    """Every option that a report may have."""


_OPTIONS = signature(_asked, eval_str=True).parameters
_BEFORE_CAMERAS = ("lifter", "seed", "bed", "sets", "because")  # of reports on virtual takes
_SHARED = ("output", "device", "rectifier", *_BEFORE_CAMERAS)  # that no report's tables take


def _report(
    name: str,
    module: str,
    options: tuple[str, ...],
    words: str,
    file: str = "evaluation",
    tables: str = "tables",
    **changed: Any,
) -> Callable[..., None]:
    """The subcommand of a report. module: of this folder; tables: its function. options: of _OPTIONS, besides -o and
    --device. words: its help. file: of the report, without its ending. changed: option=(annotation or
    None for the usual one, default)."""
    keyword = Parameter.KEYWORD_ONLY
    taken = {
        key: option.replace(kind=keyword)
        for key, option in _OPTIONS.items()
        if key in (*options, "output", "device")
    }
    for key, (annotation, default) in changed.items():
        annotation = annotation or _OPTIONS[key].annotation
        taken[key] = Parameter(key, keyword, default=default, annotation=annotation)

    def command(**given: Any) -> None:
        given = {key: option.default for key, option in taken.items()} | given
        _write(name, {"rectifier": (), **given}, file, module, tables)

    command.__signature__ = Signature([*taken.values()])  # type: ignore[attr-defined]  (what typer reads)
    command.__annotations__ = {key: option.annotation for key, option in taken.items()}
    command.__doc__ = words
    evaluate.command(name)(command)
    return command


def _write(name: str, given: dict[str, Any], file: str, module: str, tables: str) -> None:
    """Judge and write. InputError for test subjects without a reason, and for a set without takes."""
    output: Path = given["output"]
    refuse_unwritable(output)
    people, because = given.get("sets"), given.get("because", "")
    if (people not in (None, "val")) != bool(because.strip()):
        raise InputError(
            "needs-input",
            "Test subjects are looked at rarely: give --because REASON with --sets test or tennis, with these only.",
        )
    report = import_module(module if module.startswith(".") else f".{module}", __package__)
    names = given["rectifier"]
    asked = {key: given[key] for key in ("lifter", "seed", "bed") if key in given}
    own = {key: value for key, value in given.items() if key not in _SHARED}
    if "fit" in given:
        own["output"] = output
    with computing_on(given["device"]) as where:
        rectifiers = tuple(map(load_rectifier, [names] if isinstance(names, str) else names))
        question = Question(rectifiers, people=people, **asked)
        for judged in question.sets:
            judged.clips()  # a set without takes is refused before the work
        results = {
            "report": name,
            **({"judged": people} if people else {}),
            **getattr(report, tables)(question, **own),
        }
        methods = [load_lifter(given["lifter"]).method] if "lifter" in given else []
        methods += [rectifier.method for rectifier in rectifiers]
        results.setdefault("networks", [method for method in methods if "@" in method])
    results |= {"date": date.today().isoformat(), "device": where.summary()}
    output.mkdir(parents=True, exist_ok=True)
    if because:
        note_look(output, f"pcnet3d lab evaluate {name} --sets {people}", results["networks"], because)
    text = written(results, report.PAGE)
    write_text(output / f"{file}.md", text)
    write_json(output / f"{file}.json", plain(results))
    print(text)


def ledger_of(output: Path) -> Path:
    """docs/accuracy/ledger.csv where this package lies in its repository, else ledger.csv in the report's folder."""
    return ROOT / "docs" / "accuracy" / "ledger.csv" if (ROOT / ".git").exists() else output / "ledger.csv"


def note_look(output: Path, command: str, networks: Sequence[str], because: str) -> None:
    """Append a line to the ledger of looks at the test sets, for who is looked at often is no test any more: the day,
    the command, the networks with their digests, and why."""
    path = ledger_of(output)
    first = not path.exists()
    with open(path, "a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if first:
            writer.writerow(_LEDGER)
        writer.writerow([date.today().isoformat(), command, " ".join(networks), " ".join(because.split())])


errors = _report(
    "errors", "..errors.report", ("lifter", "seed", "sets", "because", "part", "fit", "answers", "errors"),
    """Test every stated error in every configuration of a run, and fit the errors of angles.

    DIR/errors.json holds one row for each statement and configuration, like docs/accuracy/errors.json.
    """,
    file="stated_errors",
)  # fmt: skip
visits = _report(
    "visits", "..errors.unchanged", ("seed", "sets", "because"),
    "Judge differences of two visits between which nothing changed; their errors were fitted with seeds 0 and 1.",
    file="visits",
)  # fmt: skip
lifters = _report(
    "lifters", "lifters", ("networks", "seeds", "part"),
    """Compare lifters person by person, to choose one.

    It lifts whole validation takes from wild and typical cameras: with noisy and exact keypoints, with and without a
    known focal length. A network takes some four minutes of a core.
    """,
    file="lifters",
)  # fmt: skip
lifter = _report(
    "lifter", "lifter", ("lifter", "seed", "sets", "because"),
    "Test a lifter by motion and posture, with and without a known focal length.",
    beds=(Annotated[Bed | None, typer.Option("--bed", help="Cameras: wild or typical; both by default.")], None),
)  # fmt: skip
rectifiers = _report(
    "rectifiers", "rectifiers", ("rectifier", *_BEFORE_CAMERAS),
    "Test rectifiers frame by frame, on lifted and on clean poses.",
)  # fmt: skip
own_data = _report(
    "own-data", "rectifiers", ("data", "rectifier", "split", "targets", "seed"),
    "Test rectifiers on clean poses of your own motion capture.",
    tables="own_tables",
)  # fmt: skip
takes = _report(
    "takes", "takes", ("rectifier", *_BEFORE_CAMERAS),
    "Test one gravity per take: errors of tilt, rotation, joints and accelerations.",
)  # fmt: skip
motion = _report(
    "motion", "motion", _BEFORE_CAMERAS,
    "Test the accelerations of wrists and ankles with each smoother.",
)  # fmt: skip
swaps = _report(
    "swaps", "swaps", ("seed", "bed", "sets", "because"),
    "Test how well exchanged limbs of simulated keypoints are found.",
)  # fmt: skip
gait = _report(
    "gait", "gait", ("rectifier", *_BEFORE_CAMERAS),
    "Test contacts, steps and figures of walks and runs, with their stated errors.",
    rectifier=(Annotated[str, typer.Option(help="A rectifier, or a network's .onnx file.")], "pcnet"),
)  # fmt: skip
jumps = _report(
    "jumps", "jumps", _BEFORE_CAMERAS,
    "Test flights, jump heights and contact times of lifted takes, with their stated errors.",
    bed=(None, "typical"),
)  # fmt: skip
verdicts = _report(
    "verdicts", "verdicts", _BEFORE_CAMERAS,
    "Test whether verdicts on poses follow their error, with the lifter as it is and made worse.",
)  # fmt: skip
repetitions = _report(
    "repetitions", "repetitions", ("lifter", "seeds", "bed"),
    "Test counts, starts and ends of repeated movements on labelled takes, captured and lifted.",
    bed=(None, "typical"),
)  # fmt: skip
real_take = _report(
    "real-take", "real_take", ("rectifier", "lifter"),
    "Test upright joints and angles on real videos of four cameras, where the truth is known.",
)  # fmt: skip
real_clips = _report(
    "real-clips", "real_rectified", ("rectifier", "lifter"),
    "Compare lifters on real clips, raw and rectified, where the truth is not known.",
)  # fmt: skip
