"""`pcnet3d demo`: makes the built-in example's files, runs the pipeline on them, and compares with the truth."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ..pipeline.core.pose import Rectified, package_version
from ..pipeline.core.rotations import angle_deg
from ..pipeline.files.atomic import SUMMARY, check_replaceable, whole_folder
from ..pipeline.reading.settings import Force, OnDevice, RunOptions
from ..pipeline.running.progress import stages
from ..pipeline.running.recipe import planned
from ..pipeline.running.run import run_files
from ..pipeline.running.sentences import conclude
from .walker.camera import R_camera_from_body, side_camera
from .walker.files import ExampleFiles, write_files
from .walker.walk import walker


def demo(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")] = Path(
        "pcnet3d-demo"
    ),
    device: OnDevice = "auto",
    force: Force = False,
) -> None:
    """Run the built-in example: a person walks, squats and raises both arms in front of a tilted camera."""
    check_replaceable(output, force)
    inputs = Path(f"{output}-input")
    walk = walker()
    camera = side_camera(walk)
    with whole_folder(inputs, force) as folder:
        files = ExampleFiles.of(folder)
        options = RunOptions(
            poses=files.poses, video=files.video, keypoints=files.keypoints, stature=walk.stature_m,
            focal=camera.focal_px, device=device,
        )  # fmt: skip
        recipe = planned(options)
        with stages(["example", "read", *(entry.use for entry in recipe.stages)]) as done:
            start = time.perf_counter()
            write_files(folder, walk, camera)
            made = {"pcnet3d": package_version(), "what": "input files of pcnet3d demo"}
            (folder / SUMMARY).write_text(json.dumps(made) + "\n", encoding="utf-8")
            done("example", time.perf_counter() - start)
            take = run_files(options, output, force=force, done=done)
    truth = R_camera_from_body(walk, camera)[take.need("poses").frame_index]
    print(f"{inputs}: a video, 2D keypoints as AlphaPose and 3D poses as MotionBERT would write them")
    print(_comparison(take.need("rectified"), truth))
    video, poses, keypoints = (inputs / path.name for path in (files.video, files.poses, files.keypoints))
    print(
        f"the same by hand: pcnet3d run {video} --poses {poses} --keypoints {keypoints} "
        f"--stature {walk.stature_m} --focal {camera.focal_px:g} -o DIR"
    )
    conclude({"": take}, output)


def _comparison(rectified: Rectified, truth: np.ndarray) -> str:
    """How far the result is from the truth R_camera_from_body (T, 3, 3), in a line."""
    up, facing = truth[:, :, 2], -truth[:, :, 0]
    found = -rectified.R_source_from_body[:, :, 0]
    level = found - (found * up).sum(axis=-1, keepdims=True) * up
    up_deg = float(np.nanmean(angle_deg(rectified.R_source_from_level[..., :, 2], up)))
    heading_deg = float(np.nanmedian(angle_deg(level, facing)))
    body_deg = float(np.nanmean(angle_deg(rectified.up_own["frames"][0], up)))
    return (
        f"against the truth ({rectified.method}): the take's up is off by {up_deg:.1f} degrees, by the body alone "
        f"{body_deg:.1f}, the heading by {heading_deg:.1f} (median over frames)"
    )
