"""What no recording of a person has: times beyond any session, rates of no camera, bodies of no size. And frame rates
to be believed: those that a user gives, and those that a file states."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.limits import limit
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from ..core.take import Video
from ..signals.filters import rate

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
