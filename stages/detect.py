"""Detecting: a video's images become one person's 2D keypoints."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..models.detector.load import load_detector
from ..models.detector.networks import Follower
from ..models.detector.video import detect
from ..pipeline.core.errors import InputError
from ..pipeline.core.messages import how_many
from ..pipeline.core.notices import notice
from ..pipeline.core.pose import package_version
from ..pipeline.core.take import Take
from ..pipeline.files.detections import Detections, load_detections
from ..pipeline.files.digest import sha256
from ..pipeline.files.names import KEYPOINTS
from ..pipeline.reading.bounds import check_fps, rate_doubts, timed
from ..pipeline.reading.people import choose_detected, first_names, joined
from ..pipeline.signals.swaps import swaps_of_take


@dataclass(frozen=True)
class Detect:
    """The stage. detector, person_detector: names of `pcnet3d list models` or .onnx files, or detector a function
    (models.detector.load). joints: the layout of what a function finds, if its number does not tell. looks: how
    often each person in each image is looked at, 1 or 2, by a network that looks at one; the mean is taken, by default
    of 2. folder: where keypoints.npz goes. checkpoint: a file for the detections so far, written every
    minute once somebody is there. resume: the checkpoint of an interrupted run, to go on from. everybody: to be found,
    by YOLOX where no person_detector is given.

    The keypoints are those of the person that the user names, else of the longest track (`choose_detected`)."""

    detector: str | Callable[..., Any] = "movenet"
    joints: str | None = None
    person_detector: str | None = None
    looks: int | None = None
    folder: Path | None = None
    checkpoint: Path | None = None
    resume: Path | None = None
    everybody: bool = False

    name: ClassVar[str] = "detect"
    needs: ClassVar[tuple[str, ...]] = ("video",)
    gives: ClassVar[tuple[str, ...]] = ("keypoints",)

    def __call__(self, take: Take) -> Take:
        video, told = take.need("video"), take.told
        if told.fps is not None:
            check_fps(told.fps)  # before the minutes that detection takes
        detector = load_detector(self.detector, self.person_detector, self.looks, self.everybody, self.joints)
        before = None if self.resume is None else load_detections(self.resume)
        digest = next((entry["sha256"] for entry in take.inputs if entry["role"] == "video"), None)
        source = f"{digest or sha256(video.path)} {package_version()}"
        if video.part is not None:
            source += f" from frame {video.part[0]}"
        detections = detect(video, detector, source, before, self._keep)
        if not len(detections.person):
            if detections.frames_seen < detections.frames:
                raise KeyboardInterrupt
            frames = video.span[1] + 1 - video.span[0]
            raise InputError(
                "nothing-usable",
                f"Nobody was found in any of the {how_many(frames, 'frame')} of {video.path} by {detections.method}; "
                "give another --detector, or check that the person is upright in the image, large enough, and in view "
                "with shoulders and hips.",
            )
        tracks = detections.people()
        names = first_names(tracks, video)
        people = joined(tracks, names)
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
            same = [int(names[str(person)]) for person in detections.person]
            same = np.array(same, detections.person.dtype)
            replace(detections, person=same).save(self.folder / KEYPOINTS)
        chosen = choose_detected(people, names.get(str(told.person), told.person), str(video.path))
        keypoints = chosen if told.fps is None else timed(chosen, told.fps).with_(notices=chosen.notices)
        take = take.with_(keypoints=keypoints)
        swapped, _ = swaps_of_take(None, keypoints)
        notices = [notice("others-missed")] if isinstance(detector, Follower) else []
        notices += [*chosen.notices, *detections.doubts(chosen)]
        if detections.frames_seen < detections.frames:
            notices.append(notice("interrupted", frame=detections.frames_seen, frames=detections.frames))
        return take.saying(*notices, *rate_doubts(told.fps, video), *swapped)

    def _keep(self, found: Detections) -> None:
        if self.checkpoint is not None and len(found.person):
            found.save(self.checkpoint)
