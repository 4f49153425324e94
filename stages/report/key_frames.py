"""The key frames of a report: which they are, what the video shows there, and the skeletons beside it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from markupsafe import Markup

from ...models.common.residuals import unsure_joints
from ...pipeline.core.layouts import Layout
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite, rotate
from ...pipeline.core.take import Take
from ...pipeline.files.video_frames import OnePass
from ...pipeline.signals.visibility import LEAST_SCORE
from ..drawing.image_lines import draw_bones
from ..drawing.page import figure, picture
from ..drawing.skeletons import body_views, key_rows, skeletons
from .events import Event, chosen_events, moments_of

FRAMES = 6
_APART = 0.04  # of the take: closer to an event, another frame shows the same
_SIDE = 360  # pixels of a key frame's longer side
_ROOM = 1.35  # around the person, in sizes of the keypoints' box
_QUALITY = 82  # of JPEG
# Right and up as one sees it, from the families' reference axes; in a world one looks north.
_SEEN = {"camera": ((1, 0, 0), (0, -1, 0)), "world": ((0, -1, 0), (0, 0, 1))}


def key_figures(take: Take, images: OnePass) -> Callable[[], list[Markup]]:
    """A function that returns a figure for each key frame: the video's image with the 2D keypoints on it, beside the
    rectified skeleton.

    Without images, the keypoints alone are drawn, or the skeleton before rectification. It raises InputError when the
    video cannot be decoded.
    """
    body = take.need("rectified").body
    shown = {event.row: event for event in chosen_events(moments_of(take), body.times, FRAMES)}
    apart = _APART * (body.times[-1] - body.times[0])
    for row in key_rows(body.without_feet.joints, FRAMES):
        if len(shown) < FRAMES and all(abs(body.times[row] - body.times[other]) > apart for other in shown):
            shown[row] = Event(row, "")

    def drawn(frame: int, image: np.ndarray) -> bytes:
        flat, layout = keypoints_at(take, frame)
        return jpeg(image, flat, layout, None if take.keypoints is None else _found(take, frame))

    pictures = images.ask([int(body.frame_index[row]) for row in shown], drawn)
    return lambda: [
        _key_figure(take, body, shown[row], pictures().get(int(body.frame_index[row])))
        for row in sorted(shown)
    ]


def _key_figure(take: Take, body: PoseSequence, event: Event, shot: bytes | None) -> Markup:
    """body: the take's poses in BODY. shot: a JPEG of the video's image."""
    row = event.row
    poses = take.need("poses")
    frame, joints = int(body.frame_index[row]), body.joints[row].astype(np.float64)
    rectified = body_views(joints)
    flat, layout = keypoints_at(take, frame)
    if shot is not None:
        before = picture(shot, f"Frame {frame} of the video with the 2D keypoints")
    elif np.isfinite(flat).any():
        before = skeletons({"2D keypoints": flat * (1, -1)}, layout, f"2D keypoints of frame {frame}")
    else:
        # Not from the pelvis, which may be missing: a drawing has its own middle.
        R_seen_from_source = np.array(_SEEN[poses.frame.family]) @ poses.frame.basis.T
        source = rotate(R_seen_from_source, poses.joints[row].astype(np.float64))
        looked_at = (
            "as the camera sees it" if poses.frame.family == "camera" else "as seen by one who looks north"
        )
        words = f"Skeleton of frame {frame} before rectification, {looked_at}"
        before = skeletons({"before": source}, poses.layout, words)
    after = skeletons(rectified, body.layout, f"Rectified skeleton of frame {frame}, two views")
    time_s = float(body.times[row])
    at_s = time_s if event.at_s is None else event.at_s
    title = ", ".join(words for words in (f"{at_s:.2f} s", event.words) if words)
    return figure([before, after], title, f"frame {frame}", time_s=round(time_s, 3))


def keypoints_at(take: Take, frame: int) -> tuple[np.ndarray, Layout]:
    """(J, 2) pixels of the 2D keypoints that were seen in a video frame, and their layout; NaN where there are none: a
    detector puts legs that it does not see somewhere. A point of which it is unsure is not drawn either, but a lift
    rests on it (pipeline/signals/visibility.py)."""
    poses, keypoints = take.need("poses"), take.keypoints
    if keypoints is None:
        return np.full((len(poses.layout), 2), np.nan), poses.layout
    drawn, at = _found(take, frame), poses.frame_index == frame
    for joint, unsure in unsure_joints(take).items():
        if joint in keypoints.layout and unsure[at].any():
            drawn[keypoints.layout.index(joint)] = np.nan
    return drawn, keypoints.layout


def _found(take: Take, frame: int) -> np.ndarray:
    """(J, 2) pixels of what the detector found in a video frame, of joints of which it is unsure too: they tell where
    the person is."""
    keypoints = take.need("keypoints")
    row = np.flatnonzero(keypoints.frame_index == frame)
    nothing = np.full((len(keypoints.layout), 2), np.nan)
    certain = keypoints.without(keypoints.confidence < LEAST_SCORE)
    return certain.joints[row[0]].copy() if len(row) else nothing


def jpeg(
    image: np.ndarray,
    keypoints: np.ndarray,
    layout: Layout,
    around: np.ndarray | None = None,
    side: int = _SIDE,
    quality: int = _QUALITY,
) -> bytes:
    """A small JPEG, its longer side of so many pixels, with keypoints (J, 2) drawn on it; of what is around the points
    `around` (N, 2), or else these; of all of the image (H, W, 3) RGB where there are none."""
    import cv2

    around = keypoints if around is None else around
    corner, size = _crop(image.shape[1::-1], around[is_finite(around)])
    left, top = corner
    part = np.ascontiguousarray(image[top : top + size[1], left : left + size[0]])
    scale = side / max(size)
    shape = (max(round(size[0] * scale), 1), max(round(size[1] * scale), 1))
    small = np.ascontiguousarray(cv2.resize(part, shape, interpolation=cv2.INTER_AREA))
    at = (keypoints + 0.5 - corner) * scale - 0.5
    draw_bones(small, at, layout, 2, edge=1)
    return _encoded(small, quality)


def lines_jpeg(image: np.ndarray) -> bytes:
    """A JPEG of a whole image (H, W, 3) RGB, large enough that lines in it can be told apart."""
    import cv2

    scale = min(2 * _SIDE / max(image.shape[:2]), 1.0)
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return _encoded(small)


def _encoded(rgb: np.ndarray, quality: int = _QUALITY) -> bytes:
    import cv2

    done, content = cv2.imencode(
        ".jpg", np.ascontiguousarray(rgb[..., ::-1]), [cv2.IMWRITE_JPEG_QUALITY, quality]
    )
    assert done
    return content.tobytes()


def _crop(size: tuple[int, int], points: np.ndarray) -> tuple[np.ndarray, tuple[int, int]]:
    """Corner and size of the square around points (N, 2) that lies in an image; all of it without points inside."""
    whole = np.array(size)
    inside = points[((points >= 0) & (points < whole)).all(axis=-1)]
    if len(inside) < 2:
        return np.zeros(2, dtype=int), size
    low, high = inside.min(axis=0), inside.max(axis=0)
    side = np.minimum(np.full(2, max(int(_ROOM * (high - low).max()), 32)), whole)
    corner = np.clip(np.round((low + high - side) / 2), 0, whole - side).astype(int)
    return corner, (int(side[0]), int(side[1]))
