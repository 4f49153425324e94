"""What the page's player holds: the skeleton on its floor, frame by frame, and small pictures of the video, the person
with the 2D keypoints (stages/drawing/player.js)."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable
from typing import Any

import numpy as np
from markupsafe import Markup

from ...models.common.residuals import unsure_joints
from ...pipeline.core.anthropometry import floor_height
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take, Video
from ...pipeline.files.video_frames import OnePass
from ...pipeline.signals.visibility import LEAST_SCORE
from ..drawing.image_lines import draw_bones
from ..drawing.page import jpeg_address, player
from ..drawing.palette import as_hex, side_colour

_MOST = 2500  # frames: a third of a megabyte
_STEPS, _MISSING = 32000, -32768
_SQUARES = 3.5  # of the floor's grid, as high as the person
_PICTURES = 60
_SEEKS = (
    1200  # video frames of a take from which on its film is of key frames alone: no others are decoded for it
)
_SIDE, _QUALITY = 280, 55  # pixels of the longer side; as JPEG, so that all are half a megabyte
_SMALLER = 90  # per cent of the frames in which the person is smaller than what the film shows
_ROOM, _LEAST_PX = 1.35, 32  # around the person, in sizes of the keypoints' box; of the image that is shown

Window = tuple[np.ndarray, tuple[int, int]]  # corner (2,) and size of a part of an image, pixels


def skeleton_player(take: Take) -> Markup:
    """HTML of the skeleton that plays, beside the video's pictures where there are such; empty of a take without a
    rotation in any frame, or of a single frame. InputError when the video cannot be decoded."""
    rectified = take.need("rectified")
    level = take.filtered if take.filtered is not None else rectified.level
    shown = np.flatnonzero(is_finite(level.without_feet.joints).any(axis=1))
    if len(shown) < 2:
        return Markup("")
    rows = np.arange(shown[0], shown[-1] + 1, -(-(shown[-1] + 1 - shown[0]) // _MOST))
    points, on_floor = _standing(level, rows)
    known_points = points[is_finite(points)]
    if not len(known_points):
        return Markup("")
    height = float(np.nanpercentile(points[..., 2].max(axis=1, where=is_finite(points), initial=0), 90))
    step = float(np.abs(known_points).max()) / _STEPS
    whole = np.where(is_finite(points)[..., None], np.nan_to_num(np.round(points / step)), _MISSING).astype(
        "<i2"
    )
    layout, metric = level.layout, level.frame.unit == "m"
    square = 0.5 if metric else height / _SQUARES
    held: dict[str, Any] = {
        "times": np.round(level.times[rows], 4).tolist(),
        "joints": points.shape[1],
        "pelvis": layout.index("pelvis"),
        "step": step,
        "height": height,
        "square": square,
        "middle": np.nan_to_num(np.nanmedian(points[:, layout.index("pelvis")], axis=0)).tolist(),
        "bones": [[*layout.indices(bone), as_hex(side_colour(*bone))] for bone in layout.bones],
        "points": b64encode(whole.tobytes()).decode("ascii"),
    }
    pictures = film(take, shown)
    held |= {"film": pictures} if pictures else {}
    what = "The video, and beside it the skeleton" if pictures else "The skeleton"
    squares = f" The squares are {square:g} m wide." if metric else ""
    how = "as it came, not levelled."
    if rectified.level_ok:
        how = f"turned upright, on the floor.{squares} {on_floor}"
    caption = (
        f"{what} {how} Orange is the person's right, blue the left. Drag to turn it; the slider moves the cursor of "
        "every chart of time."
    )
    words = "The skeleton on its floor; arrow keys turn it, space plays"
    return player(held, len(rows), words, caption, "The video at the same moment" if pictures else "")


def _standing(level: PoseSequence, rows: np.ndarray) -> tuple[np.ndarray, str]:
    """(N, J, 3) the joints of these rows with the floor at height 0, and how the floor was found, in words."""
    joints = level.joints[rows].astype(np.float64)
    feet = [
        i for i, name in enumerate(level.layout.joints) if "ankle" in name or "toe" in name or "heel" in name
    ]
    if level.root is None or not is_finite(level.root[rows]).any():
        lowest = joints[:, feet, 2].min(axis=1, where=is_finite(joints[:, feet]), initial=np.inf)
        has_foot = np.isfinite(lowest)
        usual = np.median(lowest[has_foot]) if has_foot.any() else 0.0
        joints[..., 2] -= np.where(has_foot, lowest, usual)[:, None]
        return joints, "The person's place is not known, so the lower foot is put on the floor."
    joints += level.root[rows][:, None]
    floor = floor_height(level)
    joints[..., 2] -= floor if np.isfinite(floor) else np.nanmin(joints[..., 2])
    return joints, "The floor is where the feet stand in most frames."


def film(take: Take, shown: np.ndarray) -> dict[str, list[Any]] | None:
    """Seconds and pictures, all of one size, for the rows (N,) of the poses from the first to the last that shows
    something; None of a take without images. InputError when the video cannot be decoded."""
    if take.video is None or not take.told.images:
        return None
    poses = take.need("poses")
    frames, times = poses.frame_index[shown], poses.times[shown]
    keypoints = sure_keypoints(take)
    window = windows(keypoints, take.video.size)

    def picture(frame: int, image: np.ndarray) -> str:
        return jpeg_address(jpeg(image, window(frame), keypoints, frame))

    pictures = OnePass(take.video).ask(_chosen(take.video, int(frames[0]), int(frames[-1])), picture)()
    seconds = np.interp(list(pictures), frames, times).round(4).tolist()
    return {"times": seconds, "pictures": [*pictures.values()]} if pictures else None


def sure_keypoints(take: Take) -> PoseSequence | None:
    """The 2D keypoints without those that were not seen: a detector puts legs that it does not see somewhere. A point
    of which it is unsure is not drawn either, but a lift rests on it (pipeline/signals/visibility.py)."""
    keypoints = take.keypoints
    if keypoints is None:
        return None
    hidden = np.asarray(keypoints.confidence < LEAST_SCORE)
    for joint, unsure in unsure_joints(take).items():
        if joint in keypoints.layout:
            frames = take.need("poses").frame_index[unsure]
            hidden[:, keypoints.layout.index(joint)] |= np.isin(keypoints.frame_index, frames)
    return keypoints.without(hidden)


def _chosen(video: Video, first: int, last: int) -> list[int]:
    """The video frames of the film, evenly spread."""
    keys = [frame for frame in video.key_frames if first <= frame <= last]
    frames = keys if last - first > _SEEKS and len(keys) > 1 else range(first, last + 1)
    return [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, _PICTURES).round().astype(int))]


def windows(keypoints: PoseSequence | None, size: tuple[int, int]) -> Callable[[int], Window]:
    """A function that returns which part of the image the film shows at a video frame: a square around the person, as
    large in all, or what the image has of it; all of an image of this size where no keypoints in it tell where that
    is."""
    whole = np.array(size)
    points = np.zeros((0, 1, 2)) if keypoints is None else keypoints.joints
    inside = np.asarray(((points >= 0) & (points < whole)).all(axis=-1))
    known = inside.sum(axis=1) > 1
    if keypoints is None or not known.any():
        return lambda _: (np.zeros(2, dtype=int), size)
    points = np.where(inside[..., None], points, np.nan)[known]
    low, high = np.nanmin(points, axis=1), np.nanmax(points, axis=1)
    box = float(np.percentile((high - low).max(axis=1), _SMALLER))
    width, height = np.minimum(int(max(_ROOM * box, _LEAST_PX)), whole).tolist()
    shown = np.array((width, height))
    frames, middles = keypoints.frame_index[known], (low + high) / 2

    def window(frame: int) -> Window:
        middle = np.array([np.interp(frame, frames, along) for along in middles.T])
        return np.clip(np.round(middle - shown / 2), 0, whole - shown).astype(int), (width, height)

    return window


def jpeg(image: np.ndarray, window: Window, keypoints: PoseSequence | None, frame: int) -> bytes:
    """A small JPEG of what is in the window of an image (H, W, 3) RGB, with the keypoints of that video frame."""
    import cv2

    corner, (width, height) = window
    left, top = corner
    part = np.ascontiguousarray(image[top : top + height, left : left + width])
    scale = _SIDE / max(width, height)
    shape = (max(round(width * scale), 1), max(round(height * scale), 1))
    small = cv2.resize(part, shape, interpolation=cv2.INTER_AREA)
    if keypoints is not None:
        for points in keypoints.joints[keypoints.frame_index == frame]:
            draw_bones(small, (points + 0.5 - corner) * scale - 0.5, keypoints.layout, 2, edge=1)
    done, content = cv2.imencode(
        ".jpg", cv2.cvtColor(small, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY]
    )
    assert done
    return content.tobytes()
