"""Frame rates to be believed: those that a user gives, and those that a file states."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.notices import Notice, notice
from ..core.pose import PoseSequence
from ..core.take import Video

RATES = (1.0, 1000.0)  # of video; fewer frames carry no movement, and more a camera for people does not take
_TOLERANCE = 0.01  # of a rate: 29.97 is 30
_SLOWED = 1.05  # times as many frames captured as shown: slow motion


# Notices that leave the rate open, but for what a user says against the file.
_AGAINST = frozenset(("slow-motion-stated", "clocks-contradict", "rate-against-movement"))


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
    if captured is not None and captured > _SLOWED * shown:
        if abs(used / captured - 1) <= _TOLERANCE:
            return []
        rates: dict[str, Any] = {"captured_fps": captured, "shown_fps": shown, "used_fps": used}
        return [notice("slow-motion-stated", **rates, times=captured / used)]
    if abs(used / shown - 1) <= _TOLERANCE:
        return []
    source = "file" if video is None else "video"
    return [notice("fps-contradicts", used_fps=used, source=source, shown_fps=shown, times=used / shown)]


def against_rate(said: Iterable[Notice]) -> list[Notice]:
    """Those by which the frame rate may be wrong, and with it all times and speeds."""
    return [each for each in said if each.code in _AGAINST]


def timed(poses: PoseSequence, fps: float) -> PoseSequence:
    """The poses with the times of their video frames at this rate; a notice says where a clock of their own says
    otherwise. InputError as for `check_fps`."""
    check_fps(fps)
    doubts = rate_doubts(fps, None, poses.fps if poses.time_s is not None and len(poses) > 1 else None)
    return poses.with_(time_s=poses.frame_index / fps).noted("fps", given=fps).saying(*doubts)
