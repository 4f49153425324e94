"""VideoPose3D's 2D sets of one's own videos: `data_2d_custom_<name>.npz`.

Python objects, read without unpickling: `positions_2d` is {video: {"custom": [(frames, 17, 2) pixels]}}, `metadata` has
layout_name "coco" (data/prepare_data_2d_custom.py). There is a row for every frame of the video. Each video is of one
person, the best box of each frame; where nobody was found, the script interpolated between the frames around and did
not mark it.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.arrays import has_objects, shaped
from .kit.people import People
from .kit.pickles import load_objects

name = "videopose2d"
gives = "keypoints"
reads = "VideoPose3D's 2D sets of videos, data_2d_custom_<name>.npz (option video), COCO-17"


def sniff(path: Path) -> bool:
    return has_objects(path, "positions_2d", "metadata")


def read(path: Path, video: str | None = None) -> tuple[PoseSequence]:
    """The one person of a video, whose name it gets; frame_index counts the video's frames from 0.

    video: its name, needed where the file has several. Confidences are unknown. Raises InputError when the file is not
    of this form, has another joint layout, or holds anything but arrays and plain containers, and when there are
    several videos and none is named.
    """
    metadata, where = load_objects(path, "metadata"), str(path)
    layout_name = metadata.get("layout_name") if isinstance(metadata, dict) else None
    if layout_name != "coco":
        raise InputError("wrong-content", f"{where}: expected joints in layout 'coco', got {layout_name!r}.")
    held = load_objects(path, "positions_2d")
    held = held if isinstance(held, dict) else {}
    names = ", ".join(map(str, held)) or "none"
    if video is None and len(held) > 1:
        raise InputError(
            "choose-entry", f"{where} holds the videos {names}; choose one with --set keypoints.video=NAME."
        )
    video = next(map(str, held), "") if video is None else video
    if video not in held:
        raise InputError("name-unknown", f"{where} has no video '{video}'; it holds {names}.")
    where = f"{where}, video '{video}'"
    of_video = held[video].get("custom") if isinstance(held[video], dict) else None
    if not isinstance(of_video, list) or len(of_video) != 1:
        raise InputError("wrong-content", f"{where}: expected one array of custom keypoints in a list.")
    sightings = People(str(path))
    for frame, row in enumerate(shaped(of_video[0], where, ("frames", len(COCO17), 2))):
        sightings.add(frame, row, person=video)
    (poses,) = sightings.keypoints(layouts=(COCO17,))
    return (
        poses.noted("gaps", filled="by the file's writer, where nobody was found; not marked in the file"),
    )
