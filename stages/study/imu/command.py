"""`pcnet3d imu`: a run's accelerations against inertial sensors that were strapped to the person.

A video shows motion relative to the pelvis only; an IMU feels all of it, and in walking the pelvis makes a third or
more of a wrist's acceleration. So the pelvis' own is taken from the IMU's: that of a pelvis IMU in the same world, or
of a known path of the root; without either, only the spans in which the pelvis stands still are compared.

A sensor that does not know its orientation still tells the norm of its acceleration, gravity included. Then the norm
of the video's is compared with it, of the run's own method alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ....models import load_rectifier
from ....models.common.metrics import plain
from ....pipeline.core.errors import InputError, naming
from ....pipeline.core.frames import Z_UP, change_frame
from ....pipeline.core.messages import how_many, show
from ....pipeline.core.notices import Notice, notice
from ....pipeline.core.pose import package_version
from ....pipeline.core.rotations import is_finite, turned
from ....pipeline.core.system import quoted
from ....pipeline.core.take import Take
from ....pipeline.files.atomic import add_to_list, whole_folder, write_json
from ....pipeline.files.digest import sha256
from ....pipeline.files.finished import read_run
from ....pipeline.plugins.options import call, did_you_mean, pairs
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.reading.find import find_adapter
from ....pipeline.signals.filters import CUTOFF_HZ, breaks, check_cutoff, rate
from ....pipeline.signals.imu import GRAVITY_MPS2, MOST_HZ, SEGMENTS, Imu, point_on
from ....pipeline.signals.rates import check_fps
from ..compare.align import AMBIGUOUS, WEAK
from ..compare.truth import people_in_a_world
from ..methods import method_name, methods
from .align import Alignment, Signal, agreement, align, check_overlap, heading_deg
from .motion import as_vertical, even_times, imu_norm, imu_signal, path_acceleration, still_pelvis
from .output import IMU_RECORDING, Comparison, as_markdown, as_page, write_recording

_LEAST_S = 2.0  # of compared motion
_CLOCK = 2e-4  # clocks that differ by less are called alike


def imu(
    folder: Annotated[Path, typer.Argument(help="Folder of a finished run.")],
    imu: Annotated[list[Path], typer.Option(help="File of a sensor; repeatable.")],
    segment: Annotated[
        list[str] | None,
        typer.Option(
            help="Body segment of the sensor, such as r_forearm or pelvis, one for each file; or which segment to take "
            "from a file that holds several."
        ),
    ] = None,
    adapter: Annotated[str, typer.Option(help="Format of the sensor files.")] = "auto",
    rate_hz: Annotated[
        float | None, typer.Option("--rate", help="Samples per second, for files without times.")
    ] = None,
    root: Annotated[
        Path | None,
        typer.Option(help="Motion capture in the axes and times of the sensors, for the path of the pelvis."),
    ] = None,
    offset: Annotated[float, typer.Option(help="Seconds to add to the times of the sensors.")] = 0.0,
    search: Annotated[float, typer.Option(min=0, help="Largest lag to search for, in seconds.")] = 5.0,
    cutoff: Annotated[
        float, typer.Option(help="Cut-off of the low-pass filter for video and sensors, in Hz.")
    ] = CUTOFF_HZ,
    rectifier: Annotated[
        list[str] | None,
        typer.Option(help="Also compare this rectifier, frame by frame: a name or .onnx file; repeatable."),
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option("--option", "-O", help="Option KEY=VALUE for reading the sensor files; repeatable."),
    ] = None,
) -> None:
    """Compare the accelerations of a run with inertial sensors: lag, correlation and RMSE.

    An earlier comparison of the run is replaced.
    """
    run = read_run(folder)
    others = [load_rectifier(name) for name in rectifier or ()]
    if rate_hz is not None:
        check_fps(rate_hz, "--rate", MOST_HZ)
    options = pairs(option) | ({} if rate_hz is None else {"rate_hz": rate_hz})
    sensors, compared = read_imus(imu, segment or [], adapter, options)
    sensors = {name: replace(sensor, time_s=sensor.time_s + offset) for name, sensor in sensors.items()}
    path = None if root is None else root_acceleration(root, cutoff, offset)
    results = [
        compare(
            run,
            sensors[name],
            sensors.get("pelvis"),
            path,
            search_s=search,
            cutoff_hz=cutoff,
            rectifiers=others,
        )
        for name in compared
    ]
    files = [*imu, *([root] if root else [])]
    settings = {
        "inputs": [{"file": file.name, "sha256": sha256(file)} for file in files],
        "cutoff_hz": cutoff,
        "search_s": search,
        "offset_s": offset,
    }
    segments = {result.segment: plain({**settings, **result.figures()}) for result in results}
    words = as_markdown(run.name, segments)
    content = {
        "pcnet3d": package_version(),
        "what": f"comparison of {run.name} with IMUs",
        "take": run.name,
        "segments": segments,
    }
    with whole_folder(folder / "imu", inputs=files) as partial:
        write_json(partial / "imu.json", content)
        (partial / "imu.md").write_text(words, encoding="utf-8")
        for result in results:
            (partial / f"{result.segment}.html").write_text(as_page(result, offset), encoding="utf-8")
        write_recording(run, results, words, folder, partial / IMU_RECORDING)
    add_to_list(folder, "imu")
    show(words)
    show(f"{folder / 'imu'}: {', '.join(sorted(file.name for file in (folder / 'imu').iterdir()))}")
    print(f"look at it with: pcnet3d view {quoted(folder / 'imu' / IMU_RECORDING)}")


def read_imus(
    files: Sequence[Path],
    segments: Sequence[str],
    adapter: str = "auto",
    options: dict[str, Any] | None = None,
) -> tuple[dict[str, Imu], list[str]]:
    """The sensors by segment, and which of them are to be compared: those named, or all, but never the pelvis'.

    A file whose sensor does not know its segment takes the one at its own place of `segments`. InputError when they
    do not fit.
    """
    for name in segments:
        if name not in SEGMENTS:
            raise InputError("name-unknown", f"There is no segment '{name}'; {did_you_mean(name, SEGMENTS)}")
    every: list[Imu] = []
    for place, file in enumerate(files):
        chosen = find_adapter(file, adapter, "imu")
        with naming(file):
            read = call(chosen.read, file, what=f"Adapter '{chosen.name}'", options=options or {})
        for sensor in read:
            if not sensor.segment:
                if len(segments) != len(files):
                    raise InputError(
                        "needs-input",
                        f"{file} does not say where its sensor was: give one --segment for each --imu, in their order; "
                        f"got {len(segments)} for {how_many(len(files), 'file')}.",
                    )
                sensor = replace(sensor, segment=segments[place])
            every.append(sensor)
    sensors = {sensor.segment: sensor for sensor in every}
    if len(sensors) < len(every):
        raise InputError("option-conflict", "Expected one IMU for each segment, got two for the same.")
    missing = [name for name in segments if name not in sensors]
    if missing:
        raise InputError(
            "name-unknown",
            f"The files have no sensor on {', '.join(missing)}; they have {', '.join(sensors)}.",
        )
    compared = [name for name in (segments or sensors) if name != "pelvis"]
    if not compared:
        raise InputError(
            "needs-input",
            "A video shows motion relative to the pelvis, so a pelvis IMU alone cannot be compared; add one on "
            "another segment.",
        )
    return sensors, compared


def root_acceleration(file: Path, cutoff_hz: float, offset_s: float = 0.0) -> Signal:
    """The pelvis' acceleration in a world with z up, from motion capture that kept where the pelvis was.
    InputError for any that did not."""
    if not file.is_file():
        raise InputError("cannot-open", f"Expected motion capture for --root at {file}, found no file there.")
    people = [poses for poses in people_in_a_world(file) if poses.frame.origin == "world"]
    if len(people) != 1:
        raise InputError(
            "format-unknown",
            f"Expected one person's motion capture with the path of the root in a world for --root; {file} is no such "
            "file that an adapter reads in a world.",
        )
    (poses,) = people
    path = change_frame(poses, Z_UP).joint("pelvis").astype(np.float64)
    time_s = poses.times + offset_s
    grid = even_times(time_s, cutoff_hz)
    return Signal(grid, path_acceleration(path, time_s, poses.seams, grid, cutoff_hz))


def compare(
    run: Take,
    sensor: Imu,
    pelvis: Imu | None = None,
    root: Signal | None = None,
    *,
    search_s: float = 5.0,
    cutoff_hz: float = CUTOFF_HZ,
    rectifiers: Sequence[Rectifier] = (),
) -> Comparison:
    """One sensor against every method of a run and further rectifiers (methods.methods); one without orientation
    against the run's own alone.

    The lag and the clock's rate are properties of the recordings: they are found with the run's own method and hold
    for all. The heading is each method's own. InputError when there is too little to compare.
    """
    poses = run.need("poses")
    check_cutoff(cutoff_hz, rate(poses.times))
    time_s = even_times(poses.times, cutoff_hz)
    norms = sensor.R_world_from_sensor is None
    if norms and rectifiers:
        raise InputError(
            "option-conflict",
            f"The IMU on {sensor.segment} has no orientation, so only norms of the run itself are compared; leave "
            "--rectifier out.",
        )
    if norms:
        video, signal, means = _norms(run, sensor, time_s, cutoff_hz)
    else:
        video, signal, means = _vectors(run, sensor, pelvis, root, time_s, cutoff_hz, rectifiers)
    check_overlap(time_s, signal, search_s)  # before the pelvis may be blamed
    own, step_s = list(video)[-1], float(time_s[1] - time_s[0])
    known_s = is_finite(video[own]).sum() * step_s
    if known_s < _LEAST_S:
        raise InputError(
            "nothing-usable",
            f"Expected at least {_LEAST_S:g} s of video to compare with the IMU on {sensor.segment}, got "
            f"{known_s:.1f} of {np.ptp(poses.times):.1f} s ({means}); give a longer take, or an IMU on the pelvis.",
        )
    how = align(time_s, video[own], signal, search_s)
    felt = signal(how.imu_time(time_s))
    imus = {name: turned(felt, heading_deg(values, felt)) for name, values in video.items()}
    notices, scale = list(sensor.notices), 1.0
    if not poses.frame.metric:
        scale = _size(imus[own], video[own]) / _size(video[own], imus[own])
        video = {name: scale * values for name, values in video.items()}
        notices.append(notice("imu-scale-fitted", metres=scale))
    return Comparison(
        segment=sensor.segment,
        means=means,
        alignment=replace(how, heading_deg=float("nan")) if norms else how,
        imu_hz=sensor.rate_hz,
        compared_s=float((is_finite(video[own]) & is_finite(felt)).sum() * step_s),
        metres_per_unit=scale,
        time_s=time_s,
        video=video,
        imu=imus,
        agreement={name: agreement(values, imus[name], step_s, norms) for name, values in video.items()},
        notices=(*notices, *_doubts(run, how)),
    )


def _vectors(
    run: Take,
    sensor: Imu,
    pelvis: Imu | None,
    root: Signal | None,
    time_s: np.ndarray,
    cutoff_hz: float,
    rectifiers: Sequence[Rectifier],
) -> tuple[dict[str, np.ndarray], Signal, str]:
    """Accelerations (N, 3) of the video by method at times (N,), those of the sensor, and how the pelvis' own motion
    was dealt with."""
    poses = run.need("poses")
    times, seams, rows = poses.times, breaks(poses), np.ones(len(time_s), dtype=bool)
    reference, means = root, "the path of the root is subtracted from the IMU"
    if pelvis is not None:
        reference = imu_signal(pelvis, None, cutoff_hz)
        means = "the pelvis IMU is subtracted from the IMU, in their common world"
    elif root is None:
        rows = still_pelvis(run.need("rectified").level.joints.astype(np.float64), times, seams, time_s)
        means = (
            "no pelvis IMU and no path of the root: only spans in which the pelvis stands still are compared"
        )
    video = {}
    for name, joints in methods(run, rectifiers).items():
        path = path_acceleration(point_on(sensor.segment, joints), times, seams, time_s, cutoff_hz)
        video[name] = np.where(rows[:, None], path, np.nan)
    return video, imu_signal(sensor, reference, cutoff_hz), means


def _norms(
    run: Take, sensor: Imu, time_s: np.ndarray, cutoff_hz: float
) -> tuple[dict[str, np.ndarray], Signal, str]:
    """As `_vectors`, of the run's own method: norms with gravity, carried as vertical."""
    means = f"no orientation of the IMU on {sensor.segment} is given: only the norm, gravity included, is compared"
    poses, rectified = run.need("poses"), run.need("rectified")
    times, seams, level = poses.times, breaks(poses), rectified.level
    if not poses.frame.metric:
        raise InputError(
            "needs-input",
            f"Expected a run in metres ({means}), got one without a scale; run it again with --stature METRES, or "
            "export the IMU's quaternions.",
        )
    joints, root = level.joints.astype(np.float64), level.own_root
    path, rows = point_on(sensor.segment, joints), np.ones(len(time_s), dtype=bool)
    if root is not None and is_finite(root).any():
        path = path + root
        means += "; the pelvis' own motion is that of the run's path"
    else:
        rows = still_pelvis(joints, times, seams, time_s)
        means += ", in the spans in which the pelvis stands still"
    force = path_acceleration(path, times, seams, time_s, cutoff_hz) + np.array([0.0, 0.0, GRAVITY_MPS2])
    video = np.where(rows[:, None], as_vertical(force), np.nan)
    return {method_name(rectified): video}, imu_norm(sensor, cutoff_hz), means


def _size(values: np.ndarray, other: np.ndarray) -> float:
    both = is_finite(values) & is_finite(other)
    return float(np.sqrt(values[both].var(axis=0).sum()))


def _doubts(run: Take, how: Alignment) -> list[Notice]:
    doubts, rectified = [], run.need("rectified")
    if not rectified.level_ok:
        doubts.append(notice("imu-run-not-levelled"))
    if rectified.camera == "moving":
        doubts.append(notice("imu-moving-camera"))
    if how.score < WEAK:
        doubts.append(notice("imu-weak", r=how.score))
    elif how.runner_up > AMBIGUOUS * how.score:
        doubts.append(notice("imu-lag-ambiguous", r=how.score, runner_up=how.runner_up))
    if abs(how.rate - 1) > _CLOCK:
        way = "fast" if how.rate > 1 else "slow"
        doubts.append(notice("imu-clock-differs", way=way, rate=how.rate))
    return doubts
