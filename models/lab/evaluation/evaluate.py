"""How well every part does where the truth is known:  pcnet3d evaluate REPORT -o DIR

A subcommand a report; each writes a page and the same figures as JSON. People are those that networks are chosen by,
unless `--sets test` asks for those that figures are published of.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Annotated, Any

import typer

from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.files.atomic import refuse_unwritable, whole_file
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.reading.settings import OnDevice
from ...common.metrics import plain
from ...lifter.load import load_lifter
from ...rectifier.load import load_rectifier
from ..synthetic.views import Targets
from .ledger import note_look
from .sets import EvaluationSet, Sets, evaluation_sets
from .testbed import BEDS, Bed

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


@dataclass(frozen=True)
class _Asked:
    """What every report is asked. people: whom, before what cameras, and why test subjects; None of a report on other
    data. file: of the report, without its ending."""

    name: str
    output: Path
    device: OnDevice
    lifter: str | None = None
    rectifier: Sequence[str] = ()
    people: tuple[Sets, Bed, str] | None = None
    file: str = "evaluation"

    def report(
        self,
        judge: Callable[[list[Rectifier], tuple[EvaluationSet, ...]], dict[str, Any]],
        as_markdown: Callable[[dict[str, Any]], str],
    ) -> None:
        """Judge and write. InputError for test subjects without a reason, and for a set without takes."""
        refuse_unwritable(self.output)
        sets, bed, because = self.people or ("val", "wild", "")
        if (sets != "val") != bool(because.strip()):
            raise InputError(
                "Test subjects are looked at rarely: give --because REASON with --sets test or tennis, with these only."
            )
        with computing_on(self.device) as where:
            rectifiers = [load_rectifier(name) for name in self.rectifier]
            judged = evaluation_sets(sets, bed) if self.people else ()
            for one in judged:
                one.clips()  # a set without takes is refused before the work
            results = {
                "report": self.name,
                **({"judged": sets} if judged else {}),
                **judge(rectifiers, judged),
            }
            methods = [load_lifter(self.lifter).method] if self.lifter else []
            methods += [rectifier.method for rectifier in rectifiers]
            results.setdefault("networks", [method for method in methods if "@" in method])
        results |= {"date": date.today().isoformat(), "device": where.summary()}
        self.output.mkdir(parents=True, exist_ok=True)
        if because:
            note_look(
                self.output, f"pcnet3d evaluate {self.name} --sets {sets}", results["networks"], because
            )
        text = as_markdown(results)
        with whole_file(self.output / f"{self.file}.md") as partial:
            partial.write_text(text, encoding="utf-8")
        with whole_file(self.output / f"{self.file}.json") as partial:
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

    asked = _Asked("lifters", output, device, file="lifters")
    asked.report(lambda *_: lifter_tables(networks, output / "lifts", seeds, part or ()), as_markdown)


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

    asked = _Asked("lifter", output, device, lifter, (), (sets, beds[0], because))
    asked.report(lambda *_: lifter_tables(lifter, seed, flip, sets, beds), as_markdown)


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

    asked = _Asked("rectifiers", output, device, lifter, rectifier, (sets, bed, because))
    asked.report(lambda loaded, judged: rectifier_tables(loaded, lifter, seed, flip, judged), as_markdown)


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

    asked = _Asked("own-data", output, device, None, rectifier)
    asked.report(lambda loaded, _: own_tables(loaded, data, split, targets, seed), as_markdown)


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

    asked = _Asked("takes", output, device, lifter, rectifier, (sets, bed, because))
    asked.report(lambda loaded, judged: take_tables(loaded, lifter, seed, flip, judged), as_markdown)


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

    asked = _Asked("angles", output, device, lifter, rectifier, (sets, bed, because))
    asked.report(lambda loaded, judged: angle_tables(loaded, lifter, seed, flip, judged), as_markdown)


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

    asked = _Asked("motion", output, device, lifter, (), (sets, bed, because))
    asked.report(lambda _, judged: motion_tables(lifter, seed, flip, judged), as_markdown)


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

    asked = _Asked("swaps", output, device, lifter, (), (sets, bed, because))
    asked.report(lambda _, judged: swap_tables(lifter, seed, flip, judged), as_markdown)


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

    asked = _Asked("place", output, device, lifter, (), (sets, bed, because))
    asked.report(lambda _, judged: place_tables(lifter, seed, flip, judged), as_markdown)


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

    asked = _Asked("gait", output, device, lifter, [rectifier], (sets, bed, because))
    asked.report(lambda loaded, judged: gait_tables(loaded[0], lifter, seed, flip, judged), as_markdown)


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

    asked = _Asked("real-take", output, device, lifter, rectifier)
    asked.report(lambda loaded, _: real_take_tables(loaded, lifter, flip), as_markdown)


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

    asked = _Asked("real-clips", output, device, lifter, rectifier)
    asked.report(lambda loaded, _: real_clip_tables(loaded, lifter, flip), as_markdown)


@evaluate.command("real-motion")
def real_motion(
    output: Output, lifter: Lifter = "pcnet3d", flip: Flip = False, device: OnDevice = "auto"
) -> None:
    """Judge velocities and accelerations of wrists and ankles on real recordings."""
    from .real_motion import as_markdown, real_motion_tables

    asked = _Asked("real-motion", output, device, lifter, ["pcnet"])
    asked.report(lambda loaded, _: real_motion_tables(loaded[0], lifter, flip), as_markdown)
