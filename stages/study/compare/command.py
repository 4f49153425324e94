"""`pcnet3d compare`: finished runs against each other (two visits, cameras or estimators), against motion capture or
against inertial sensors."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import say
from ....pipeline.core.pose import package_version
from ....pipeline.files.atomic import add_to_list, plain, whole_folder, write_json
from ....pipeline.files.digest import sha256
from ....pipeline.files.finished import read_run
from ....pipeline.files.markers import Up
from ....pipeline.reading.settings import Force
from ....pipeline.running.sentences import point_to
from ....pipeline.signals.filters import CUTOFF_HZ
from .align import Align
from .comparison import as_page, compared, conclusion, figures, shift_in_words
from .imu import compared_with, read_sensors, sensed_page
from .side import load_side, named_apart, with_truth


def compare(
    folders: Annotated[
        list[Path], typer.Argument(help="Folders of finished runs; the first is the reference.")
    ],
    truth: Annotated[
        Path | None,
        typer.Option(help="Motion capture to use as the reference: TRC, C3D or .npz."),
    ] = None,
    up: Annotated[Up | None, typer.Option(help="Vertical axis of the motion capture.")] = None,
    unit: Annotated[str | None, typer.Option(help="Unit of the motion capture: m, cm, mm or inch.")] = None,
    rate: Annotated[float | None, typer.Option(help="Frames per second of the motion capture.")] = None,
    imu: Annotated[
        list[Path] | None,
        typer.Option(
            help="File of an inertial sensor, to compare one run with its accelerations; repeatable."
        ),
    ] = None,
    segment: Annotated[
        list[str] | None,
        typer.Option(help="Body segment of each --imu, such as r_forearm; that of pelvis is subtracted."),
    ] = None,
    align: Annotated[
        Align,
        typer.Option(
            help="How to match the runs in time: by time stamps, or by correlating the angles. auto uses stamps for "
            "runs of one recording, correlate for motion capture, and compares others as two motions."
        ),
    ] = "auto",
    offset: Annotated[
        float, typer.Option(help="Seconds to add to the times of all runs except the reference.")
    ] = 0.0,
    search: Annotated[
        float, typer.Option(min=0, help="Largest time offset to search for, in seconds.")
    ] = 5.0,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            help="Folder for the results; by default `compare` in the folder of the first run.",
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Compare runs with each other or with motion capture: differences with their errors, and angles over time.

    Or one run with inertial sensors: lag, correlation and error of the accelerations."""
    of_truth = {"--truth": truth, "--up": up, "--unit": unit, "--rate": rate}
    others = [name for name, value in of_truth.items() if value is not None]
    if imu:
        others += [f"--align {align}"] * (align != "auto") + ["another run"] * (len(folders) > 1)
        if others:
            raise InputError(
                "option-conflict",
                f"--imu compares one run with sensors, got {', '.join(others)} as well; leave that out.",
            )
        run, sensors = read_run(folders[0]), read_sensors(imu, segment or [], offset)
        sensed = compared_with(run, sensors, search)
        content: dict[str, Any] = {
            "what": "comparison with inertial sensors",
            "take": run.name,
            "inputs": [{"file": file.name, "sha256": sha256(file)} for file in imu],
            "cutoff_hz": CUTOFF_HZ,
            "offset_s": offset,
            "search_s": search,
            "sensors": [sensor.figures() for sensor in sensed],
        }
        html, notices = sensed_page(run.name, sensed), [each for sensor in sensed for each in sensor.notices]
        lines = [str(sensor) for sensor in sensed]
    else:
        if segment:
            raise InputError("option-conflict", "--segment is for sensors; give it with --imu FILE.")
        if truth is None and others:
            raise InputError(
                "option-conflict",
                "--up, --unit and --rate need motion capture; give it with --truth FILE.",
            )
        sides = named_apart([load_side(folder) for folder in folders])
        if truth is not None:
            sides = with_truth(sides, truth, up, unit, rate)
        comparison = compared(sides, align, offset, search)
        content = {"what": "comparison", **figures(comparison)}
        html, notices = as_page(comparison), comparison.notices
        lines = [line for pair in comparison.pairs for line in (*conclusion(pair), shift_in_words(pair))]
    target = folders[0] / "compare" if output is None else output
    read = (*folders, *(imu or ()), *([truth] if truth else ()))
    with whole_folder(target, force, read) as partial:
        write_json(partial / "compare.json", plain({"pcnet3d": package_version(), **content}))
        (partial / "compare.html").write_text(html, encoding="utf-8")
    if output is None:
        add_to_list(folders[0], "compare")
    for each in notices:
        say("warning", each.text)
    print("\n".join(lines))
    point_to(target)
