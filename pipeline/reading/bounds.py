"""What no recording of a person has: times beyond any session, rates of no camera, bodies of no size. And frame rates
to be believed: those that a user gives, and those that a file states."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.limits import limit
from ..core.messages import how_many
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from ..core.take import Video
from ..signals.filters import rate
from ..signals.visibility import LEAST_SCORE

RATES = limit("times.rates")  # of video


def check_times(time_s: np.ndarray, where: str) -> None:
    """InputError for times (T,) beyond a million seconds, and for fewer than 1 or more than 1,000 rows a second."""
    longest_s = limit("times.longest")
    if np.abs(time_s).max(initial=0) > longest_s:
        worst = float(time_s[np.abs(time_s).argmax()])
        raise InputError(
            "times-broken",
            f"{where}: expected times within {longest_s:.0f} s, got {worst:.6g} s; count seconds from the recording's "
            "begin, or give the frame rate (--fps).",
        )
    fps = rate(time_s)
    if np.isfinite(fps) and not RATES[0] <= fps <= RATES[1]:
        raise InputError(
            "times-broken",
            f"{where}: expected {RATES[0]:g} to {RATES[1]:g} rows a second, got {fps:.3g}: its times go on by "
            f"{1 / fps:.3g} s; if these are other units, such as milliseconds, write seconds, or give the frame rate "
            "(--fps).",
        )


def check_size(poses: PoseSequence, where: str) -> None:
    """InputError for bodies, in 2D or 3D, of no size that a unit could have, or as far away as nobody is."""
    joints_there = is_finite(poses.joints).sum(axis=1)
    if not joints_there.any():
        return
    high, low = (f.reduce(poses.joints, axis=1).astype(np.float64) for f in (np.fmax, np.fmin))
    far = float(max(np.nanmax(high), -np.nanmin(low)))
    extent = (high - low)[joints_there > 1] if (joints_there > 1).any() else np.ones((1, 1))
    size = float(np.nanmedian(extent, axis=0).max())
    (smallest, largest), farthest = limit("body.sizes"), limit("body.farthest")
    if size != 0 and not (smallest <= size <= largest and far <= farthest):  # of size 0 is a failed frame
        raise InputError(
            "wrong-axes",
            f"{where}: expected a body of {smallest:g} to {largest:g} units, within {farthest:g} of the origin, "
            f"got one of {size:.3g}, up to {far:.3g} away; write coordinates in metres, or in pixels for keypoints.",
        )


def image_size_doubts(keypoints: PoseSequence, image_size: tuple[int, int] | None) -> list[Notice]:
    """A warning where many visible keypoints lie far outside an image of that size. InputError if most do: every pose
    would be left out as outside the image."""
    points = keypoints.joints[is_finite(keypoints.joints) & ~(keypoints.confidence < LEAST_SCORE)]
    if image_size is None or not len(points):
        return []
    size, beyond = np.array(image_size), limit("image-size.beyond")
    share = float(((points < -beyond * size) | (points > (1 + beyond) * size)).any(axis=-1).mean())
    right, down = np.ceil(points.max(axis=0)).astype(int).tolist()  # of the smallest that has them all
    width, height = image_size
    if share > limit("image-size.wrong"):
        raise InputError(
            "bad-value",
            f"Expected the size of the image that the keypoints are of, got {width}x{height}, outside which "
            f"{100 * share:.0f} % of them lie: give --set read.image_size=WIDTHxHEIGHT, at least {right}x{down}, or "
            "the video that they were detected in.",
        )
    values = {"width": width, "height": height, "right": right, "down": down}
    doubtful = share > limit("image-size.doubtful")
    return [notice("image-size-doubtful", share_percent=100 * share, **values)] if doubtful else []


def grid_rows(sequence: PoseSequence, step: int = 1) -> int:
    """How many rows there are once every frame from the first to the last has one, or every `step`th. InputError when
    that many cannot be one recording, before they take any memory."""
    first, last = (int(number) for number in sequence.frame_index[[0, -1]])
    rows = (last - first) // step + 1
    if rows > max(limit("frame-numbers.rows"), 2 * len(sequence)):
        raise InputError(
            "times-broken",
            f"Expected frame numbers of one recording, got {how_many(len(sequence), 'row')} numbered {first} to "
            f"{last}; check the frame numbers of the 2D file.",
        )
    return rows


def check_fps(fps: float, flag: str = "--fps", most: float = RATES[1]) -> float:
    """The rate itself. InputError for one outside 1 to `most` a second. flag: of the option that gives it."""
    if not RATES[0] <= fps <= most:
        raise InputError(
            "bad-value",
            f"Expected a rate of {RATES[0]:g} to {most:g} a second ({flag}), got {fps:g}; give that of the recording.",
        )
    return fps


def rate_doubts(given: float | None, video: Video | None, stated: float | None = None) -> list[Notice]:
    """Notices where the rate that is used contradicts the file.

    given: frames a second that the user gives, None to take the video's; stated: those of a file of keypoints or poses,
    which count where there is no video.
    """
    shown = stated if video is None else video.fps
    captured = None if video is None else video.capture_fps
    used = shown if given is None else given
    if used is None or shown is None or not np.isfinite([used, shown]).all():
        return []
    tolerance = limit("fps-contradicts.tolerance")
    if captured is not None and captured > limit("slow-motion-stated.times") * shown:
        if abs(used / captured - 1) <= tolerance:
            return []
        rates: dict[str, Any] = {"captured_fps": captured, "shown_fps": shown, "used_fps": used}
        return [notice("slow-motion-stated", **rates, times=captured / used)]
    if abs(used / shown - 1) <= tolerance:
        return []
    source = "file" if video is None else "video"
    return [notice("fps-contradicts", used_fps=used, source=source, shown_fps=shown, times=used / shown)]


def timed(poses: PoseSequence, fps: float) -> PoseSequence:
    """The poses with the times of their video frames at this rate; a notice says where a clock of their own says
    otherwise. InputError as for `check_fps`."""
    check_fps(fps)
    doubts = rate_doubts(fps, None, poses.fps if poses.time_s is not None and len(poses) > 1 else None)
    return poses.with_(time_s=poses.frame_index / fps).noted("fps", given=fps).saying(*doubts)
