"""VideoPose3D's 2D sets: `data_2d_custom_<name>.npz` and `data_2d_h36m_<detector>.npz`.

Python objects, read without unpickling: `positions_2d` is {video: {"custom": [(frames, 17, 2) pixels]}}, for Human3.6M
{subject: {action: [an array a camera]}}; `metadata` has layout_name "coco" or "h36m" (data/prepare_data_2d_custom.py).
There is a row for every frame of the video. Each video is of one person, the best box of each frame; where nobody was
found, the script interpolated between the frames around and did not mark it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import COCO17, H36M17
from ..pipeline.core.messages import how_many
from ..pipeline.core.pose import PoseSequence
from .kit.numpy import has_objects, load_objects, shaped
from .kit.people import People

name = "videopose2d"
gives = "keypoints"
reads = "VideoPose3D's 2D sets, data_2d_<set>_<detector>.npz (options video, action, camera), COCO-17 or Human3.6M"

_LAYOUTS = {"coco": COCO17, "h36m": H36M17}


def sniff(path: Path) -> bool:
    return has_objects(path, "positions_2d", "metadata")


def read(
    path: Path, video: str | None = None, action: str | None = None, camera: int = 0
) -> tuple[PoseSequence]:
    """The one person of a video, whose name it gets; frame_index counts the video's frames from 0.

    video: its name (of Human3.6M, the subject), needed where the file has several. action: the same of what the
    subject does; a custom set has but one. camera: of those that saw it, from 0.
    Confidences are unknown. Raises InputError when the file is not of this form, has another joint layout, or holds
    anything but arrays and plain containers, and when there are several videos and none is named.
    """
    metadata, where = load_objects(path, "metadata"), str(path)
    layout_name = metadata.get("layout_name") if isinstance(metadata, dict) else None
    if layout_name not in _LAYOUTS:
        raise InputError(
            "wrong-content", f"{where}: expected joints in layout 'coco' or 'h36m', got {layout_name!r}."
        )
    video, actions = _entry(load_objects(path, "positions_2d"), "video", video, where)
    _, cameras = _entry(actions, "action", action, f"{where}, video '{video}'")
    if not isinstance(cameras, list) or not 0 <= camera < len(cameras):
        count = len(cameras) if isinstance(cameras, list) else 0
        raise InputError(
            "bad-value",
            f"{where}, video '{video}': it has {how_many(count, 'camera')}, counted from 0; got camera={camera}.",
        )
    layout = _LAYOUTS[layout_name]
    points = shaped(cameras[camera], f"{where}, video '{video}'", ("frames", len(layout), 2))
    sightings = People(where)
    for frame, row in enumerate(points):
        sightings.add(frame, row, person=video)
    (poses,) = sightings.keypoints(layouts=(layout,))
    return (
        poses.noted("gaps", filled="by the file's writer, where nobody was found; not marked in the file"),
    )


def _entry(held: Any, what: str, key: str | None, where: str) -> tuple[str, Any]:
    """Name and value of the one that is asked for, or of the only one."""
    if not isinstance(held, dict) or not held:
        raise InputError(
            "wrong-content", f"{where}: expected a dict with a {what} each, got {type(held).__name__}."
        )
    names = ", ".join(map(str, held))
    if key is None and len(held) == 1:
        return str(next(iter(held))), next(iter(held.values()))
    if key is None:
        raise InputError(
            "choose-entry", f"{where} holds the {what}s {names}; choose one with --set keypoints.{what}=NAME."
        )
    if key not in held:
        raise InputError("name-unknown", f"{where} has no {what} '{key}'; it holds {names}.")
    return key, held[key]
