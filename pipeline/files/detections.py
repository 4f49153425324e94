"""Everybody whom a detector found in a video, frame by frame, in one .npz file that is a result and a checkpoint."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from ..core.errors import InputError
from ..core.frames import IMAGE
from ..core.layouts import layout_named
from ..core.messages import first_few, how_many
from ..core.notices import Notice, Weight, notice
from ..core.pose import MadeBy, PoseSequence
from .arrays import load_all, write_arrays
from .names import KEYPOINTS

_NUMBERS = {  # dimensions, kind of dtype
    "frame_index": (1, "i"), "time_s": (1, "f"), "person": (1, "i"), "joints": (3, "f"), "confidence": (2, "f"),
    "box": (2, "f"), "cuts": (1, "i"), "frames": (0, "i"), "frames_seen": (0, "i"),
    "damaged": (1, "i"), "repeated": (1, "i"), "change": (1, "f"),
}  # fmt: skip
_MOST = 0.5  # where more repeat, as of 10 frames a second in 30, accelerations were up to twice too high
_FROZEN = 12  # images in a row that are told as one that stands still
MOVES = 12.0  # grey values of `change`: a key frame leaves a still scene as it is within that
_OF_ROWS = ("frame_index", "time_s", "person", "joints", "confidence", "box")
_WORDS = ("layout", "method", "source")
# Mean score of shoulders and hips, median over a take, that MoveNet of one person gives to people: 0.57 and more, also
# to those 17 pixels high or on their heads; trees in videos without anybody have 0.38 to 0.5.
_SURE = 0.5
FEWEST_FRAMES = 10  # of a person who gets a run beside others; fewer cannot be levelled


@dataclass(frozen=True, eq=False)
class Detections:
    """One row for each person of each frame, frames in order.

    frame_index, person: (N,) numbers of the video frame and of the person. time_s: (N,) seconds. joints: (N, J, 2)
    pixels. confidence: (N, J) in [0, 1]. box: (N, 4) left, top, right, bottom. frames: of the video, up to the last to
    be looked at; `frames_seen` of them were. cuts: (C,) frames that begin another scene, or another piece of one.
    layout: name of the joints' layout. method: of the detector. source: what these rest on, the video's SHA-256 first;
    another run may only go on when its own is the same. damaged: (D,) frames whose data the decoder called corrupt.
    repeated: (R,) frames whose image only repeats the one before. change: (F,) grey values, of each frame's image from
    the one before (`Glance.change_to`), NaN where unknown.
    """

    frame_index: np.ndarray
    time_s: np.ndarray
    person: np.ndarray
    joints: np.ndarray
    confidence: np.ndarray
    box: np.ndarray
    cuts: np.ndarray
    frames: int
    frames_seen: int
    layout: str
    method: str
    source: str
    damaged: np.ndarray
    repeated: np.ndarray
    change: np.ndarray

    def doubts(self, person: PoseSequence) -> list[Notice]:
        """Notices of what makes one of the people doubtful as somebody, and the images as those of one take."""
        doubts = self._hardly_anybody(person)
        if len(self.cuts):
            doubts.append(notice("scene-changes", count=len(self.cuts), frames=first_few(self.cuts)))
        if len(self.damaged):
            damage = f"The video is damaged at frame {first_few(self.damaged)}"
            doubts.append(notice("video-damaged", damage=damage))
        return doubts + self._repeats(person)

    def _repeats(self, person: PoseSequence) -> list[Notice]:
        """Notices of repeated images while a person is seen; where most repeat, quick movements are lost."""
        frames, (first, last) = person.frame_index, person.frame_index[[0, -1]]
        if (np.diff(self.repeated[self.repeated > last], prepend=last, append=self.frames_seen) == 1).all():
            last = self.frames_seen - 1  # to the end the person is in the image that stands still
        repeated = self.repeated[(self.repeated > first) & (self.repeated <= last)]
        runs = np.split(repeated, np.flatnonzero(np.diff(repeated) > 1) + 1)
        frozen = [run for run in runs if len(run) >= _FROZEN]
        if frozen and np.isin(frames[1:], repeated).all():
            return [notice("images-frozen", weight="suspicious", frames=f"{first} to {last}")]
        if frozen:
            still = np.concatenate(frozen)
            weight: Weight = "suspicious" if len(still) > _MOST * (last + 1 - first) else "warning"
            spans = first_few([f"{run[0] - 1} to {run[-1]}" for run in frozen])
            return [
                notice("images-frozen", weight=weight, frames=spans),
                *replace(self, repeated=np.setdiff1d(self.repeated, still))._repeats(person),
            ]
        if not len(repeated):
            return []
        spans = [f"{run[0]} to {run[-1]}" if len(run) > 1 else run[0] for run in runs]
        change = self.change[first + 1 : last + 1]
        # Where hardly anything moves nobody can tell a repeat.
        compared = len(repeated) + int((np.delete(change, repeated - first - 1) >= MOVES).sum())
        weight = "suspicious" if len(repeated) > _MOST * compared else "warning"
        where = f"at frame {first_few(spans)}"
        return [notice("images-repeated", weight=weight, repeated=len(repeated), of=compared, where=where)]

    def _hardly_anybody(self, person: PoseSequence) -> list[Notice]:
        """Notices where MoveNet, whose scores are known, finds a person in few images of many, or is so unsure of one
        that it may be none."""
        if not self.method.startswith("movenet@"):
            return []
        frames = len(person)
        # Images that were looked at: of a part of a video, or a live camera, fewer than `frames_seen`.
        images = 1 + np.isfinite(self.change).sum() + len(self.cuts)
        few = frames < FEWEST_FRAMES and 2 * frames < images
        reasons = [f"found in {how_many(frames, 'frame')} only, by shoulders and hips"] if few else []
        torso = person.layout.indices(("l_shoulder", "r_shoulder", "l_hip", "r_hip"))
        sure = float(np.median(person.confidence[:, torso].mean(axis=1)))
        if sure < _SURE:
            reasons.append(f"shoulders and hips score {sure:.2f} (people have 0.6 or more)")
        return [notice("hardly-a-person", person=person.person, reason=reason) for reason in reasons]

    def people(self) -> tuple[PoseSequence, ...]:
        """One sequence a person in IMAGE, in order of appearance."""
        people, names = [], np.unique(self.person)
        for person in names:
            mine = self.person == person
            scene = int(np.searchsorted(self.cuts, self.frame_index[mine][0], side="right"))
            poses = PoseSequence(
                joints=self.joints[mine],
                layout=layout_named(self.layout),
                frame=IMAGE,
                confidence=self.confidence[mine],
                time_s=self.time_s[mine],
                frame_index=self.frame_index[mine],
                person=str(person),
                scene=scene,
                made_by=MadeBy("estimated", self.method),
                detected_in=self.source.partition(" ")[0],
            )
            poses = poses.noted(
                "detect",
                detector=self.method,
                people=len(names),
                cuts=len(self.cuts),
                scene=scene,
                frames_seen=self.frames_seen,
                frames=self.frames,
            )
            people.append(poses)
        return tuple(people)

    def save(self, path: Path) -> None:
        """Write them as plain arrays; all of the file or none."""
        write_arrays(path, **{field.name: getattr(self, field.name) for field in fields(self)})


def load_detections(path: Path) -> Detections:
    """What `save` wrote; InputError for anything else."""
    content = {}
    try:
        held = load_all(path, *_NUMBERS, *_WORDS)
        for name, (dimensions, kind) in _NUMBERS.items():
            array = held[name]
            if array.ndim != dimensions or array.dtype.kind != kind:
                raise ValueError(f"array '{name}' is {array.dtype} of shape {array.shape}")
            content[name] = array if dimensions else int(array)
        content |= {name: str(held[name]) for name in _WORDS}
        rows = {len(content[name]) for name in _OF_ROWS}
        if len(rows) != 1 or not content["joints"].shape[1:] == (len(layout_named(content["layout"])), 2):
            raise ValueError("its arrays do not belong together")
        if 0 in rows:
            raise ValueError("it holds nobody")
    except ValueError as error:
        raise InputError(
            "file-damaged", f"Expected 2D keypoints of a run ({KEYPOINTS}) at {path}: {error}."
        ) from None
    return Detections(**content)
