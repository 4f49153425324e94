"""Detecting: a video's images become one person's 2D keypoints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..models.detector.leaps import LARGER
from ..models.detector.load import load_detector
from ..models.detector.topdown import Follower
from ..models.detector.video import detect
from ..pipeline.core.errors import InputError
from ..pipeline.core.layouts import LIMBS, layout_named
from ..pipeline.core.messages import how_many
from ..pipeline.core.notices import Notice, notice
from ..pipeline.core.pose import PoseSequence, package_version
from ..pipeline.core.take import Take
from ..pipeline.files.detections import Detections, listed
from ..pipeline.files.digest import sha256
from ..pipeline.files.names import KEYPOINTS
from ..pipeline.files.video_frames import shown_size
from ..pipeline.reading.bounds import check_fps, rate_doubts, timed
from ..pipeline.reading.choose import choose_detected
from ..pipeline.reading.tracker import PACE, REACH, extent
from ..pipeline.signals.swaps import treated

_FASTEST = 6.0  # of a body's size a second: a sprint of 10 m/s


@dataclass(frozen=True)
class Detect:
    """The stage. detector, person_detector: names of `pcnet3d list models` or .onnx files, or detector a function
    (models.detector.function). joints: the layout of what a function finds, if its number does not tell. looks: how
    often each person in each image is looked at, 1 to 4; the mean is taken. By default 2, or 1 for a network that finds
    people by itself. folder: where keypoints.npz goes. everybody: to be found, by YOLOX where no person_detector is
    given.

    The keypoints are those of the person that the user names, else of the longest track (`choose_detected`)."""

    detector: str | Callable[..., Any] = "movenet"
    joints: str | None = None
    person_detector: str | None = None
    looks: int | None = None
    folder: Path | None = None
    everybody: bool = False

    name: ClassVar[str] = "detect"
    needs: ClassVar[tuple[str, ...]] = ("video",)
    gives: ClassVar[tuple[str, ...]] = ("keypoints",)

    def __call__(self, take: Take) -> Take:
        video, told = take.need("video"), take.told
        if told.fps is not None:
            check_fps(told.fps)  # before the minutes that detection takes
        detector = load_detector(
            self.detector,
            self.person_detector,
            self.looks,
            self.everybody,
            self.joints,
        )
        digest = next((entry["sha256"] for entry in take.inputs if entry["role"] == "video"), None)
        source = f"{digest or sha256(video.path)} {package_version()}"
        if video.part is not None:
            source += f" from frame {video.part[0]}"
        found = detect(video, detector, source)
        if not len(found.person):
            frames = video.span[1] + 1 - video.span[0]
            raise InputError(
                "nothing-usable",
                f"Nobody was found in any of the {how_many(frames, 'frame')} of {video.path} by {found.method}; give "
                "another --detector, or check that the person is upright in the image, large enough, and in view with "
                "shoulders and hips.",
            )
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
            found.save(self.folder / KEYPOINTS)
        people = found.people()
        chosen = choose_detected(people, told.person, str(video.path))
        keypoints = chosen if told.fps is None else timed(chosen, told.fps).with_(notices=chosen.notices)
        _, keypoints, swapped, _ = treated(None, keypoints, told.swaps)
        assert keypoints is not None
        take = take.with_(keypoints=keypoints)
        doubts = rate_doubts(told.fps, video)
        alone = [notice("others-missed")] if isinstance(detector, Follower) else []
        return take.saying(*alone, *_notices(found, people, chosen, shown_size(video)), *doubts, *swapped)


def _notices(
    found: Detections, people: tuple[PoseSequence, ...], chosen: PoseSequence, size: tuple[int, int]
) -> list[Notice]:
    """What the user should know about who was found where. size: the image's width and height."""
    notices = [*chosen.notices, *found.doubts(chosen)]
    others = sorted((one for one in people if one.person != chosen.person), key=len, reverse=True)
    again = [one.person for one in others if _may_be(found, one, chosen, size)]
    if again:
        notices.append(notice("lost-and-found", again=listed(again), person=chosen.person))
    return notices


def _may_be(found: Detections, one: PoseSequence, other: PoseSequence, size: tuple[int, int]) -> bool:
    """Whether two tracks may be of one person: never in one image, in one scene, and wherever one goes on for the
    other, as large, by all but the arms, which may be up, and within reach of one who had not gone out of the image.
    size: the image's width and height."""
    rows = np.isin(found.person, [int(one.person), int(other.person)])
    corners, time_s, frames = found.box[rows].reshape(-1, 2, 2), found.time_s[rows], found.frame_index[rows]
    ends = np.flatnonzero(np.diff(found.person[rows]))
    goes_on = ends + 1
    if (np.diff(frames) <= 0).any() or np.ptp(np.searchsorted(found.cuts, frames, side="right")):
        return False
    middle, layout = corners.mean(axis=1), layout_named(found.layout)
    trunk_legs = [joint for joint in LIMBS if joint in layout and not joint.endswith(("elbow", "wrist"))]
    body = extent(found.joints[rows][:, layout.indices(trunk_legs)])
    larger, smaller = (of(body[ends], body[goes_on]) for of in (np.maximum, np.minimum))
    away_s = time_s[goes_on] - time_s[ends]
    way = np.linalg.norm(middle[goes_on] - middle[ends], axis=1)
    near = way <= (REACH + _FASTEST * away_s) * np.maximum(*(extent(corners)[at] for at in (ends, goes_on)))
    before = np.maximum(ends - PACE, np.concatenate([[0], goes_on[:-1]]))
    went_s = np.maximum(time_s[ends] - time_s[before], 1e-9)
    gone_to = middle[ends] + (middle[ends] - middle[before]) * (away_s / went_s)[:, None]
    left = (corners[ends, 0] <= 0) & (gone_to < 0) | (corners[ends, 1] >= size) & (gone_to > size)
    return bool(((larger <= LARGER * smaller) & near & ~left.any(axis=1)).all())
