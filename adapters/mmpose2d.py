"""2D results of MMPose 1.x: JSON of the inferencer (--pred-out-dir) or of its demo scripts (formats.md 3).

The inferencer writes a list of {frame_id, instances}, frames from 0; the demos write {meta_info,
instance_info: [{frame_id, instances}]}, frames from 1 (demo/topdown_demo_with_mmdet.py counts before it
looks). Of images, the inferencer writes a folder with a list of instances each. An instance is {keypoints:
[[x, y], ...], keypoint_scores, bbox, bbox_score}, of COCO-17, Halpe-26 or a whole-body model.
Track numbers are not written: people are joined frame by frame. A keypoint of three numbers is 3D output,
whose axes are mirrored, and is refused. Scores are the maxima of heatmaps or SimCC bins, no probabilities.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17
from ..pipeline.core.pose import PoseSequence
from .kit.clock import Moments
from .kit.frames import first_person, keypoints_of, people
from .kit.json import beginning, field
from .kit.people import People

name = "mmpose2d"
gives = "keypoints"
reads = (
    "2D JSON of MMPose 1.x, inferencer (of a video or a folder of images) or demo, of 17, 26 or 133 joints"
)
marks = ("frame_id", "instances", "keypoints", "keypoint_scores")


def sniff(path: Path) -> bool:
    found = first_person(path)
    if found is None or found[1] or "image_id" in found[0]:
        return False
    keypoints = found[0].get("keypoints")
    # The beginning of a file may have cut the last keypoint short.
    first = keypoints[0] if isinstance(keypoints, list) and len(keypoints) > 1 else None
    return isinstance(first, list) and len(first) == 2


def read(path: Path) -> tuple[PoseSequence, ...]:
    """One sequence a person, joined from frame to frame by nearness; frame_index counts from 0, and of a
    folder of images is the number in their names.

    A frame without instances has no row. Scores above 1 are clipped and counted in the history; scores that
    are all alike, as some decoders write them, are unknown. Raises InputError when the file is not of this
    form, is 3D, or names joints of another order.
    """
    content = beginning(path)
    if isinstance(content, dict):
        _check_names(content.get("meta_info"), str(path))
    moments, found = Moments(str(path)), People(str(path))
    for moment, person, where in people(path, "MMPose's 2D results", moments):
        field(person, "keypoint_scores", where)
        found.add(moment, *keypoints_of(person, where))
    return found.keypoints(moments.clock())


def _check_names(meta: Any, where: str) -> None:
    """Other datasets of MMPose have 17 joints too, in another order: PoseTrack18, Human3.6M, AP-10K."""
    names = meta.get("keypoint_id2name") if isinstance(meta, dict) else None
    if not isinstance(names, dict):
        return
    written = [
        str(names.get(str(i))).replace("left_", "l_").replace("right_", "r_") for i in range(len(COCO17))
    ]
    if written != list(COCO17.joints):
        raise InputError(
            "wrong-content",
            f"{where}: expected joints in COCO's order, got those of dataset {meta.get('dataset_name')!r}: "
            f"{', '.join(written)}; run MMPose with a COCO-17 or Halpe-26 model.",
        )
