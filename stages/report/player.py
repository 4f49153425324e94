"""What the page's player holds: the skeleton on its floor, frame by frame, and the video's pictures of the person
(stages/drawing/player.js)."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from markupsafe import Markup

from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.take import Take, Video
from ...pipeline.files.video_frames import OnePass
from ..drawing.page import jpeg_address, player
from ..drawing.palette import as_hex, side_colour
from .pictures import jpeg, keypoints_at

_MOST = 2500  # frames: a third of a megabyte
_STEPS, _MISSING = 32000, -32768
_SQUARES = 3.5  # of the floor's grid, as high as the person
_PICTURES = 60  # of the film
_SEEKS = (
    1200  # video frames of a take, from which the film has key frames alone: no others are decoded for it
)
_SIZE = 90  # per cent of the frames in which the person is smaller than what the film shows
_LOWEST = 2  # per cent of the frames in which a foot may be under the floor


def skeleton_player(take: Take, images: OnePass) -> Callable[[], Markup]:
    """A function that returns the HTML of the skeleton that plays, beside the video's pictures where there are such;
    nothing of a take without a rotation in any frame, or of a single frame. It raises InputError when the video cannot
    be decoded."""
    rectified = take.need("rectified")
    level = take.filtered if take.filtered is not None else rectified.level
    shown = np.flatnonzero(is_finite(level.without_feet.joints).any(axis=1))
    if len(shown) < 2:
        return Markup
    film = _film(take, shown, images)
    return lambda: _player(level, rectified.level_ok, shown, film())


def _player(
    level: PoseSequence, level_ok: bool, shown: np.ndarray, film: dict[str, list[Any]] | None
) -> Markup:
    """shown: the rows (N,) in which something of the person is."""
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
    held |= {"film": film} if film else {}
    squares = f" The squares are {square:g} m wide." if metric else ""
    how = f"turned upright, on the floor.{squares} {on_floor}" if level_ok else "as it came, not levelled."
    caption = (
        f"{'The video, and beside it the' if film else 'The'} skeleton {how} Orange is the person's right, blue the "
        "left. Drag to turn it; the slider moves the cursor of every chart of time."
    )
    words = "The skeleton on its floor; arrow keys turn it, space plays"
    return player(held, len(rows), words, caption, "The video at the same moment" if film else "")


def _film(take: Take, shown: np.ndarray, images: OnePass) -> Callable[[], dict[str, list[Any]] | None]:
    """A function that returns seconds and pictures, of one size each, for the rows (N,) from the first to the last that
    shows something: of the person, or of the whole image where no keypoints tell where that is; None of a take without
    images."""
    if take.video is None:
        return lambda: None
    poses = take.need("poses")
    frames, times = poses.frame_index[shown], poses.times[shown]
    at = {frame: keypoints_at(take, frame) for frame in _chosen(take.video, int(frames[0]), int(frames[-1]))}
    around = _around({frame: points for frame, (points, _) in at.items() if is_finite(points).sum() > 1})

    def drawn(frame: int, image: np.ndarray) -> str:
        return jpeg_address(jpeg(image, *at[frame], around(frame)))

    pictures = images.ask(at, drawn)

    def film() -> dict[str, list[Any]] | None:
        shot = pictures()
        seconds = np.interp(list(shot), frames, times).round(4).tolist()
        return {"times": seconds, "pictures": [*shot.values()]} if shot else None

    return film


def _chosen(video: Video, first: int, last: int) -> list[int]:
    """The video frames of the film, evenly spread."""
    keys = [frame for frame in video.key_frames if first <= frame <= last]
    frames = keys if last - first > _SEEKS and len(keys) > 1 else range(first, last + 1)
    return [frames[i] for i in np.unique(np.linspace(0, len(frames) - 1, _PICTURES).round().astype(int))]


def _around(keypoints: Mapping[int, np.ndarray]) -> Callable[[int], np.ndarray]:
    """A function that returns the corners (2, 2) of what the film shows at a video frame, of one size in all, by the
    keypoints (J, 2) in pixels of some frames; NaN without any."""
    if not keypoints:
        return lambda _: np.full((2, 2), np.nan)
    frames = np.array(sorted(keypoints))
    lows, highs = (
        np.stack([end(keypoints[frame], axis=0) for frame in frames]) for end in (np.nanmin, np.nanmax)
    )
    half = float(np.percentile((highs - lows).max(axis=1), _SIZE)) / 2

    def corners(frame: int) -> np.ndarray:
        middle = np.array([np.interp(frame, frames, along) for along in (lows + highs).T / 2])
        return np.stack([middle - half, middle + half])

    return corners


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
    heights = joints[:, feet, 2]
    known = np.isfinite(heights).any()
    joints[..., 2] -= np.nanpercentile(heights, _LOWEST) if known else np.nanmin(joints[..., 2])
    return joints, "The floor is at the lowest height of the feet."
