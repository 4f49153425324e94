"""`pcnet3d lab bench floors`: what runs cost beyond what no program could leave out.

A floor reads the same files, asks the same networks once about every frame, and writes a recording and a table as large
as the run's. Both are measured in CPU seconds of a process of their own, start and imports included.
"""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ...examples.walker.camera import side_camera
from ...examples.walker.files import write_files, write_keypoints, write_poses
from ...examples.walker.long_video import write_long_video
from ...examples.walker.walk import walker
from ...pipeline.core.conversions import remap
from ...pipeline.core.device import computing_on
from ...pipeline.core.frames import IMAGE
from ...pipeline.core.layouts import HALPE26
from ...pipeline.core.pose import PoseSequence
from ...pipeline.reading.settings import OnDevice, RunOptions

bench = typer.Typer(help="Measure speed on this machine.", no_args_is_help=True)


@bench.callback()
def _commands() -> None:  # with it, `floors` is a word of the command, though it is the only one
    pass


@bench.command()
def floors(
    frames: Annotated[int, typer.Option(min=100, help="Frames of the longest walk.")] = 10_000,
    detector: Annotated[str, typer.Option(help="As for `run`.")] = "movenet",
    device: OnDevice = "auto",
) -> None:
    """Compare the CPU time of four runs with that of reading their files, asking the networks, and writing."""
    from ..detector.load import load_detector

    load_detector(detector)  # downloaded, or refused, before the work
    print(f"{'run':18}{'CPU s':>8}{'floor':>8}{'ratio':>8}")
    for name, written_to in {
        "300 poses": partial(of_poses, frames=300),
        "demo with video": of_demo,
        "3 s of video": partial(of_video, seconds=3.0, detector=detector),
        f"{frames} poses": partial(of_poses, frames=frames),
    }.items():
        with tempfile.TemporaryDirectory() as folder:
            run_s, floor_s = measured(written_to(Path(folder)).with_(device=device), Path(folder) / "out")
        print(f"{name:18}{run_s:8.2f}{floor_s:8.2f}{run_s / floor_s:8.1f}", flush=True)


def of_poses(folder: Path, frames: int) -> RunOptions:
    """Poses and keypoints of the example's person on a treadmill."""
    walk, camera = walker(seconds=frames / 30), side_camera(walker())
    walk = replace(walk, world=walk.world - walk.root[:, None] + walker().root[-1])
    poses, keypoints = folder / "X3D.npy", folder / "alphapose-results.json"
    rows, rng = np.arange(frames), np.random.default_rng(0)
    write_keypoints(keypoints, walk, camera, rows, 1.0, rng)
    write_poses(poses, walk, camera, rows, 0.008, rng)
    return RunOptions(poses=poses, keypoints=keypoints, fps=30, image_size=(camera.width, camera.height))


def of_demo(folder: Path) -> RunOptions:
    """What `pcnet3d demo` runs on."""
    files = write_files(folder, walker(), side_camera(walker()))
    return RunOptions(poses=files.poses, video=files.video, keypoints=files.keypoints)


def of_video(folder: Path, seconds: float, detector: str) -> RunOptions:
    """A video alone."""
    write_long_video(folder / "walker.mp4", seconds)
    return RunOptions(video=folder / "walker.mp4", detector=detector)


def measured(options: RunOptions, output: Path) -> tuple[float, float]:
    """CPU seconds of a run into `output`, and of its floor, each in a process of its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        run_s, floor_s = pool.map(partial(_cpu_s, options, output), (_run, _floor))
    return run_s, floor_s


def _cpu_s(options: RunOptions, output: Path, action: Callable[[RunOptions, Path], object]) -> float:
    """Of this process, which is a new one, and of those that it waited for, when the action is done."""
    action(options, output)
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _run(options: RunOptions, output: Path) -> None:
    from ...pipeline.running.run import run_files

    run_files(options, output)


def _floor(options: RunOptions, output: Path) -> None:
    """output: of the run, whose table is written once more."""
    from ...pipeline.core.lifted import ToLift
    from ..lifter.builtin import lifted
    from ..rectifier.load import load_rectifier

    with computing_on(options.device):
        lift = lifted(ToLift(*_seen(options))).poses.joints
        joints = lift if options.poses is None else np.load(options.poses).astype(np.float32)
        R, _ = load_rectifier("pcnet").rotation(joints)
    _record(joints, np.swapaxes(R, -1, -2) @ np.swapaxes(joints, -1, -2), options.video, output)


def _seen(options: RunOptions) -> tuple[PoseSequence, tuple[int, int]]:
    """Every image decoded; keypoints as they are given, or found in one look at each image; and the image's size."""
    from ...pipeline.files.video_frames import images_from
    from ...pipeline.reading.load import read_video
    from ..detector.load import load_detector

    detector = None if options.keypoints else load_detector(options.detector or "movenet")
    found, before, size = [], (), options.image_size
    if options.video is not None:
        video = read_video(options.video)
        size = video.size
        for _, image in images_from(video):
            if detector is not None:
                before = detector.people(image, before)
                found.append(before[0].xy if before else np.full((len(detector.layout), 2), np.nan))
    assert size is not None
    if detector is not None:
        return remap(PoseSequence(np.array(found), detector.layout, IMAGE)), size
    assert options.keypoints is not None
    rows = json.loads(options.keypoints.read_text(encoding="utf-8"))
    points = np.array([row["keypoints"] for row in rows]).reshape(len(rows), -1, 3)
    return remap(PoseSequence(points[..., :2], HALPE26, IMAGE)), size


def _record(joints: np.ndarray, body: np.ndarray, video: Path | None, output: Path) -> None:
    """A recording of the poses before and after, of the video and of every column of the run's table; and the table."""
    import pyarrow.parquet as pq
    import rerun as rr

    table = pq.read_table(output / "kinematics.parquet")
    pq.write_table(table, output / "floor.parquet")
    recording = rr.RecordingStream("floor")
    recording.save(output / "floor.rrd")
    if video is not None:
        recording.log("video", rr.AssetVideo(path=video), static=True)
    for name, points in (("source", joints), ("body", np.swapaxes(body, -1, -2))):
        time = rr.TimeColumn("frame", sequence=np.arange(len(points)))
        columns = rr.Points3D.columns(positions=points.reshape(-1, 3))
        recording.send_columns(name, [time], columns.partition([points.shape[1]] * len(points)))
    time = rr.TimeColumn("frame", sequence=np.arange(table.num_rows))
    for name in table.column_names:
        values = table[name].to_numpy()
        if values.dtype.kind == "f":
            recording.send_columns(f"table/{name}", [time], rr.Scalars.columns(scalars=values))
    recording.flush()
