"""What runs cost beyond what no program could leave out:  python tests/floors.py [FRAMES [DETECTOR]]

A floor reads the same files, asks the same networks once about every frame, and writes a recording and a table as large
as the run's. Both are measured in CPU seconds of a process of their own, start and imports included. FRAMES: of the
longest walk, 10,000 if it is not given. DETECTOR: as for `pcnet3d run`.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_files, write_keypoints, write_poses
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import HALPE26, IMAGE, PoseSequence, RunOptions, remap, rotate, run_files, transpose


def of_poses(folder: Path, frames: int) -> RunOptions:
    """Poses and keypoints of the example's person on a treadmill."""
    walk, camera = walker(seconds=frames / 30), side_camera(walker())
    walk = replace(walk, world=walk.world - walk.root[:, None] + walker().root[-1])
    poses, keypoints = folder / "X3D.npy", folder / "alphapose-results.json"
    rows, rng = np.arange(frames), np.random.default_rng(0)
    write_keypoints(keypoints, walk, camera, rows, 1.0, rng)
    write_poses(poses, walk, camera, rows, 0.008, rng)
    return RunOptions(poses=poses, keypoints=keypoints, fps=30, image_size=(camera.width, camera.height))


def of_demo(folder: Path, detector: str | None = None) -> RunOptions:
    """What `pcnet3d demo` runs on; with a detector its video alone."""
    files = write_files(folder, walker(), side_camera(walker()))
    if detector:
        return RunOptions(video=files.video, detector=detector)
    return RunOptions(poses=files.poses, video=files.video, keypoints=files.keypoints)


def measured(options: RunOptions, output: Path) -> tuple[float, float]:
    """CPU seconds of a run into `output`, and of its floor, each in a process of its own."""
    with ProcessPoolExecutor(1, mp_context=get_context("spawn"), max_tasks_per_child=1) as pool:
        run_s, floor_s = pool.map(partial(cpu_s, options, output), (run_files, floor))
    return run_s, floor_s


def cpu_s(options: RunOptions, output: Path, action: Callable[[RunOptions, Path], object]) -> float:
    """Of this process, which is a new one, and of those that it waited for, when the action is done."""
    action(options, output)
    return sum(os.times()[:4])


def floor(options: RunOptions, output: Path) -> None:
    """output: of the run, whose table is written once more."""
    from pcnet3d.models.lifter.builtin import lifted
    from pcnet3d.models.rectifier.load import load_rectifier
    from pcnet3d.pipeline import ToLift

    lift = lifted(ToLift(*seen(options))).poses.joints
    joints = lift if options.poses is None else np.load(options.poses).astype(np.float32)
    R_camera_from_body, _ = load_rectifier("pcnet").rotation(joints)
    record(joints, rotate(transpose(R_camera_from_body), joints), options.video, output)


def seen(options: RunOptions) -> tuple[PoseSequence, tuple[int, int]]:
    """Every image decoded; keypoints as they are given, or found in one look at each image; and the image's size."""
    from pcnet3d.models.detector.load import load_detector
    from pcnet3d.pipeline.files.video_frames import images_from
    from pcnet3d.pipeline.reading.load import read_video

    detector = None if options.keypoints else load_detector(options.detector)
    people, before, size = [], (), options.image_size
    if options.video is not None:
        video = read_video(options.video)
        size = video.size
        for _, image in images_from(video):
            if detector is not None:
                before = detector.people(image, before)
                people.append(before[0].xy if before else np.full((len(detector.layout), 2), np.nan))
    if detector is not None:
        return remap(PoseSequence(np.array(people), detector.layout, IMAGE)), size
    rows = json.loads(options.keypoints.read_text(encoding="utf-8"))
    points = np.array([row["keypoints"] for row in rows]).reshape(len(rows), -1, 3)
    return remap(PoseSequence(points[..., :2], HALPE26, IMAGE)), size


def record(joints: np.ndarray, body: np.ndarray, video: Path | None, output: Path) -> None:
    """A recording of the poses before and after, of the video and of every column of the run's table; and the table."""
    import pyarrow.parquet as pq
    import rerun as rr

    table = pq.read_table(output / "kinematics.parquet")
    pq.write_table(table, output / "floor.parquet")
    recording = rr.RecordingStream("floor")
    recording.save(output / "floor.rrd")
    if video is not None:
        recording.log("video", rr.AssetVideo(path=video), static=True)
    for name, points in (("source", joints), ("body", body)):
        time = rr.TimeColumn("frame", sequence=np.arange(len(points)))
        columns = rr.Points3D.columns(positions=points.reshape(-1, 3))
        recording.send_columns(name, [time], columns.partition([points.shape[1]] * len(points)))
    time = rr.TimeColumn("frame", sequence=np.arange(table.num_rows))
    for name in table.column_names:
        values = table[name].to_numpy()
        if values.dtype.kind == "f":
            recording.send_columns(f"table/{name}", [time], rr.Scalars.columns(scalars=values))
    recording.flush()


def main() -> None:
    given = sys.argv[1:]
    frames, detector = int(given[0]) if given else 10_000, given[1] if given[1:] else "movenet"
    print(f"{'run':18}{'CPU s':>8}{'floor':>8}{'ratio':>8}")
    for name, written_to in {
        "300 poses": partial(of_poses, frames=300),
        "demo with video": of_demo,
        "its video alone": partial(of_demo, detector=detector),
        f"{frames} poses": partial(of_poses, frames=frames),
    }.items():
        with tempfile.TemporaryDirectory() as folder:
            run_s, floor_s = measured(written_to(Path(folder)), Path(folder) / "out")
        print(f"{name:18}{run_s:8.2f}{floor_s:8.2f}{run_s / floor_s:8.1f}", flush=True)


if __name__ == "__main__":
    main()
