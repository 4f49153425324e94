"""How well every part does where the truth is known:  pcnet3d evaluate REPORT -o DIR

A subcommand a report; each writes a page and the same figures as JSON. People are those that networks are chosen by,
unless `--sets test` asks for those that figures are published of.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from ...pipeline.errors import InputError
from ...pipeline.reading.settings import OnDevice
from ..synthetic.views import Targets
from .sets import EvaluationSet, Sets, evaluation_sets
from .testbed import BEDS, Bed

if TYPE_CHECKING:
    from ...pipeline.plugins.protocols import Rectifier

evaluate = typer.Typer(help="Judge lifters, rectifiers and what follows them, where the truth is known.")

Output = Annotated[Path, typer.Option("-o", "--output", help="Folder for the report, .md and .json.")]
Lifter = Annotated[str, typer.Option(help="pcnet3d (built-in), or an .onnx file.")]
Rectifiers = Annotated[
    list[str], typer.Option("--rectifier", help="A rectifier, or a network's .onnx file; repeatable.")
]
Seed = Annotated[int, typer.Option(min=0, help="Random seed.")]
Cameras = Annotated[
    Bed, typer.Option(help="wild: steep and tilted with long lenses too; typical: as people film.")
]
People = Annotated[
    Sets,
    typer.Option(help="Whom to judge: those that networks are chosen by, or, with --because, test subjects."),
]
Because = Annotated[
    str, typer.Option(help="Why test subjects are looked at; kept in docs/accuracy/ledger.csv, or in DIR.")
]
Flip = Annotated[bool, typer.Option("--flip", help="Average with the mirrored lift.")]
_BOTH = ["geometric", "pcnet"]
_Judge = Callable[[list["Rectifier"], tuple[EvaluationSet, ...]], dict[str, Any]]


def _report(
    report: str,
    output: Path,
    device: OnDevice,
    judge: _Judge,
    as_markdown: Callable[[dict[str, Any]], str],
    lifter: str | None = None,
    rectifier: Sequence[str] = (),
    people: tuple[Sets, Bed, str] | None = None,
    file: str = "evaluation",
) -> None:
    """Judges and writes; what every report has in common. people: whom, before what cameras, and why test subjects."""
    import json
    from datetime import date

    from ...pipeline.device import computing_on
    from ...pipeline.files.atomic import refuse_unwritable, whole_file
    from ..common.metrics import plain
    from ..lifter.load import load_lifter
    from ..rectifier.load import load_rectifier
    from .ledger import note_look

    refuse_unwritable(output)
    sets, bed, because = people or ("val", "wild", "")
    if (sets == "test") != bool(because.strip()):
        raise InputError(
            "--sets test looks at the test subjects, which is rare: say why with --because, and only then."
        )
    with computing_on(device) as where:
        rectifiers = [load_rectifier(name) for name in rectifier]
        judged = evaluation_sets(sets, bed) if people else ()
        for one in judged:
            one.clips()  # a set without takes is refused before the work
        results = {"report": report, **({"judged": sets} if people else {}), **judge(rectifiers, judged)}
        methods = [*([load_lifter(lifter).method] if lifter else []), *(each.method for each in rectifiers)]
        results.setdefault("networks", [name for name in methods if "@" in name])
    results |= {"date": date.today().isoformat(), "device": where.summary()}
    output.mkdir(parents=True, exist_ok=True)
    if because:
        note_look(output, f"pcnet3d evaluate {report} --sets {sets}", results["networks"], because)
    text = as_markdown(results)
    with whole_file(output / f"{file}.md") as partial:
        partial.write_text(text, encoding="utf-8")
    with whole_file(output / f"{file}.json") as partial:
        partial.write_text(json.dumps(plain(results), indent=1), encoding="utf-8")
    print(text)


@evaluate.command()
def lifters(
    networks: Annotated[list[str], typer.Argument(help="pcnet3d (built-in), or .onnx files of lifters.")],
    output: Output,
    seeds: Annotated[int, typer.Option(min=1, help="Cameras of how many random seeds.")] = 3,
    part: Annotated[
        list[str] | None, typer.Option(help='Only this part, such as "CMU val" or "real take"; repeatable.')
    ] = None,
    device: OnDevice = "auto",
) -> None:
    """Compare lifters person by person, to choose one.

    Whole validation takes before wild and typical cameras, and the real take, with noisy keypoints and exact ones, the
    focal length known and not. Errors are kept in DIR/lifts: the same command goes on where it was stopped.
    """
    from .lifters import as_markdown, lifter_tables

    def judge(*_: Any) -> dict[str, Any]:
        return lifter_tables(networks, output / "lifts", seeds, part or ())

    _report("lifters", output, device, judge, as_markdown, file="lifters")


@evaluate.command()
def lifter(
    output: Output,
    lifter: Lifter = "pcnet3d",
    seed: Seed = 0,
    bed: Annotated[Bed | None, typer.Option(help="Cameras: wild or typical; both by default.")] = None,
    sets: People = "val",
    because: Because = "",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge a lifter by motion and posture, its focal length known and not."""
    from .lifter import as_markdown, lifter_tables

    beds = tuple(BEDS) if bed is None else (bed,)

    def judge(*_: Any) -> dict[str, Any]:
        return lifter_tables(lifter, seed, flip, sets, beds)

    _report("lifter", output, device, judge, as_markdown, lifter, (), (sets, beds[0], because))


@evaluate.command()
def rectifiers(
    output: Output,
    rectifier: Rectifiers = _BOTH,
    lifter: Lifter = "pcnet3d",
    seed: Seed = 0,
    bed: Cameras = "wild",
    sets: People = "val",
    because: Because = "",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge rectifiers frame by frame, on lifted and on clean poses."""
    from .rectifiers import as_markdown, rectifier_tables

    def judge(loaded: list[Rectifier], judged: tuple[EvaluationSet, ...]) -> dict[str, Any]:
        return rectifier_tables(loaded, seed, lifter, judged, flip)

    _report("rectifiers", output, device, judge, as_markdown, lifter, rectifier, (sets, bed, because))


@evaluate.command("own-data")
def own_data(
    data: Annotated[Path, typer.Argument(help="Motion capture, a file of pcnet3d mocap.")],
    output: Output,
    rectifier: Rectifiers = _BOTH,
    split: Annotated[
        Path | None, typer.Option(help="JSON whose `test` says whom to judge; everybody without.")
    ] = None,
    targets: Annotated[Targets, typer.Option(help="Gravity and heading, or the file's axes.")] = "body",
    seed: Seed = 0,
    device: OnDevice = "auto",
) -> None:
    """Judge rectifiers on clean poses of your own motion capture."""
    from .rectifiers import as_markdown, own_tables

    def judge(loaded: list[Rectifier], _: Any) -> dict[str, Any]:
        return own_tables(loaded, data, split, targets, seed)

    _report("own-data", output, device, judge, as_markdown, None, rectifier)


@evaluate.command()
def takes(
    output: Output,
    rectifier: Rectifiers = _BOTH,
    lifter: Lifter = "pcnet3d",
    seed: Seed = 0,
    bed: Cameras = "wild",
    sets: People = "val",
    because: Because = "",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge one gravity a take: tilt, stated errors, accelerations, one take from eight cameras."""
    from .takes import as_markdown, take_tables

    def judge(loaded: list[Rectifier], judged: tuple[EvaluationSet, ...]) -> dict[str, Any]:
        return take_tables(loaded, lifter, seed, flip, judged)

    _report("takes", output, device, judge, as_markdown, lifter, rectifier, (sets, bed, because))


@evaluate.command()
def angles(
    output: Output,
    rectifier: Rectifiers = _BOTH,
    lifter: Lifter = "pcnet3d",
    seed: Seed = 0,
    bed: Cameras = "wild",
    sets: People = "val",
    because: Because = "",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge joint angles, their rates and their stated errors."""
    from .angles import angle_tables, as_markdown

    def judge(loaded: list[Rectifier], judged: tuple[EvaluationSet, ...]) -> dict[str, Any]:
        return angle_tables(loaded, lifter, seed, flip, judged)

    _report("angles", output, device, judge, as_markdown, lifter, rectifier, (sets, bed, because))


@evaluate.command()
def motion(
    output: Output,
    lifter: Lifter = "pcnet3d",
    seed: Seed = 0,
    bed: Cameras = "wild",
    sets: People = "val",
    because: Because = "",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge accelerations of wrists and ankles and their stated errors, by smoother."""
    from .motion import as_markdown, motion_tables

    def judge(_: Any, judged: tuple[EvaluationSet, ...]) -> dict[str, Any]:
        return motion_tables(lifter, seed, flip, judged)

    _report("motion", output, device, judge, as_markdown, lifter, (), (sets, bed, because))


@evaluate.command()
def swaps(
    output: Output,
    lifter: Lifter = "pcnet3d",
    seed: Seed = 0,
    bed: Cameras = "wild",
    sets: People = "val",
    because: Because = "",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge how exchanged limbs and overturned depth, put into takes, are found."""
    from .swaps import as_markdown, swap_tables

    def judge(_: Any, judged: tuple[EvaluationSet, ...]) -> dict[str, Any]:
        return swap_tables(lifter, seed, flip, judged)

    _report("swaps", output, device, judge, as_markdown, lifter, (), (sets, bed, because))


@evaluate.command()
def place(
    output: Output,
    lifter: Lifter = "pcnet3d",
    seed: Seed = 0,
    bed: Cameras = "typical",
    sets: People = "val",
    because: Because = "",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge the pelvis's path before the camera and its stated error."""
    from .place import as_markdown, place_tables

    def judge(_: Any, judged: tuple[EvaluationSet, ...]) -> dict[str, Any]:
        return place_tables(lifter, seed, flip, judged)

    _report("place", output, device, judge, as_markdown, lifter, (), (sets, bed, because))


@evaluate.command()
def gait(
    output: Output,
    rectifier: Annotated[str, typer.Option(help="A rectifier, or a network's .onnx file.")] = "pcnet",
    lifter: Lifter = "pcnet3d",
    seed: Seed = 0,
    bed: Cameras = "wild",
    sets: People = "val",
    because: Because = "",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge contacts, steps and figures of walks and runs, with their stated errors."""
    from .gait import as_markdown, gait_tables

    def judge(loaded: list[Rectifier], judged: tuple[EvaluationSet, ...]) -> dict[str, Any]:
        return gait_tables(loaded[0], lifter, seed, flip, judged)

    _report("gait", output, device, judge, as_markdown, lifter, [rectifier], (sets, bed, because))


@evaluate.command("real-take")
def real_take(
    output: Output,
    rectifier: Rectifiers = _BOTH,
    lifter: Lifter = "pcnet3d",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Judge the way from the video to upright joints and angles, on real videos of four cameras with truth."""
    from .real_take import as_markdown, real_take_tables

    def judge(loaded: list[Rectifier], _: Any) -> dict[str, Any]:
        return real_take_tables(loaded, lifter, flip)

    _report("real-take", output, device, judge, as_markdown, lifter, rectifier)


@evaluate.command("real-clips")
def real_clips(
    output: Output,
    rectifier: Rectifiers = _BOTH,
    lifter: Lifter = "pcnet3d",
    flip: Flip = False,
    device: OnDevice = "auto",
) -> None:
    """Compare lifters on real clips, raw and rectified, where nobody knows the truth."""
    from .real_rectified import as_markdown, real_clip_tables

    def judge(loaded: list[Rectifier], _: Any) -> dict[str, Any]:
        return real_clip_tables(loaded, lifter, flip)

    _report("real-clips", output, device, judge, as_markdown, lifter, rectifier)


@evaluate.command("real-motion")
def real_motion(
    output: Output, lifter: Lifter = "pcnet3d", flip: Flip = False, device: OnDevice = "auto"
) -> None:
    """Judge velocities and accelerations of wrists and ankles on real recordings."""
    from .real_motion import as_markdown, real_motion_tables

    def judge(loaded: list[Rectifier], _: Any) -> dict[str, Any]:
        return real_motion_tables(loaded[0], lifter, flip)

    _report("real-motion", output, device, judge, as_markdown, lifter, ["pcnet"])
