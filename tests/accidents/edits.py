"""What users do to their files by accident: {name: (what is done, the codes of which one has to tell it)}."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from pcnet3d.pipeline.core.layouts import COCO17, H36M17, Layout

from .material import Bases, Given
from .slips import (
    CHOSEN_BY,
    LAST,
    SLIPS,
    focal_times,
    kept_rows,
    resized,
    sides_of,
    told_rate,
)

CLOCK = (
    "rate-against-movement", "rows-lost", "rows-added", "fps-contradicts", "gait-unlike-any-seen",
)  # fmt: skip
TOGETHER = (
    "keypoints-not-of-poses", "keypoints-not-of-video",
)  # fmt: skip
SHAPE = (
    "depth-scaled", "bones", "flat", "stature",
    "limbs-copied", "left-and-right", "mirrored", "legs-against-arms",
    "image-stretched", "poses-smooth",
)  # fmt: skip
GAPS = ("joints-filled", "joints-coincide", "joints-exchanged", "duplicates")
SIDES = ("mirrored", "legs-against-arms", "left-and-right", *TOGETHER)
UP = ("nobody-upright", "upside-down", "not-levelled")
PEOPLE = ("leaps", "leap-between-people", "strays-removed", "people-by-poses-alone")


@dataclass(frozen=True)
class Edit:
    """base, name; codes: one of which has to be told, unless it is refused; empty where all is fine, and then figures
    may change, for the take is another one. part: "first", or "chosen by", "looked at once" and
    "last" of the later ones."""

    base: str
    name: str
    make: Callable[[Given, Bases], Given]
    codes: tuple[str, ...] = ()
    part: str = "first"

    def __str__(self) -> str:
        return f"{self.base}: {self.name}"


def edits() -> Iterator[Edit]:
    """All of them."""
    lifted = (
        "walker", "walk_crop", "07_03", "08_04", "accad-m1_run", "accad-m1_lift-box", "tennis-jangel_Derecha_0",
    )  # fmt: skip
    for base in lifted:
        for name, (make, codes) in LIFTED.items():
            yield Edit(base, name, make, codes)
    for base in ("walker poses", "walk_crop poses", "07_03 poses", "accad-m1_lift-box poses"):
        for name, (make, codes) in POSES.items():
            yield Edit(base, name, make, codes)
    for base in ("walker", "walk_crop"):
        for name, (make, codes) in FILMED.items():
            yield Edit(base, name, make, codes)
    for name, (takes, make, codes) in (SLIPS | LAST).items():
        part = "last" if name in LAST else "chosen by" if name in CHOSEN_BY else "looked at once"
        for base in takes:
            yield Edit(base, name, make, codes, part)


def _every(step: int, of: int) -> Callable[[Given, Bases], Given]:
    return lambda given, _: kept_rows(given, np.flatnonzero(np.arange(len(given.frames)) % step < of))


def _points(change: Callable[[np.ndarray, np.ndarray], np.ndarray], video: bool = False) -> Any:
    """change: of pixels (T, 17, 2) by the image's size."""

    def make(given: Given, bases: Bases) -> Given:
        assert given.points is not None
        moved = change(given.points[..., :2].copy(), given.size)
        points = np.concatenate([moved, given.points[..., 2:]], axis=-1)
        return given.with_(points=points, video=given.video if video else None)

    return make


def _poses(change: Callable[[np.ndarray], np.ndarray], alone: bool = False) -> Any:
    """change: of joints (T, 17, 3)."""

    def make(given: Given, bases: Bases) -> Given:
        assert given.poses is not None
        return given.with_(poses=change(given.poses.copy()), points=None if alone else given.points)

    return make


def _told(**words: Any) -> Callable[[Given, Bases], Given]:
    return lambda given, _: given.with_(words=given.words | words)


def _turned(given: Given, _: Bases) -> Given:
    assert given.points is not None
    width, height = given.words["image_size"]
    x, y, score = np.moveaxis(given.points, -1, 0)
    points = np.stack([height - y, x, score], axis=-1)
    return given.with_(points=points, words=given.words | {"image_size": (height, width)}, video=None)


def _two(given: Given, bases: Bases) -> Given:
    """The second half is another person's, to the side."""
    assert given.points is not None
    middle = len(given.points) // 2
    points = given.points.copy()
    points[middle:, :, 0] = 0.6 * points[middle:, :, 0] + 0.4 * given.size[0] * (
        points[middle, 5, 0] < given.size[0] / 2
    )
    points[middle:, :, 1] *= 0.6
    return given.with_(points=points, video=None)


def _of_other(given: Given, bases: Bases) -> Given:
    """Keypoints of another recording."""
    other = bases["08_04"].points
    assert other is not None
    assert given.points is not None
    points = np.resize(other, given.points.shape)
    scale = np.ptp(given.points[..., 1]) / max(np.ptp(points[..., 1]), 1.0)
    points[..., :2] = (points[..., :2] - points[..., :2].mean(axis=(0, 1))) * scale + given.points[
        ..., :2
    ].mean(axis=(0, 1))
    return given.with_(points=points)


def _late(rows: int) -> Callable[[Given, Bases], Given]:
    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        kept = slice(max(rows, 0), None)
        points = np.roll(given.points, rows, axis=0)[kept]
        poses = None if given.poses is None else given.poses[kept]
        return given.with_(points=points, frames=given.frames[kept], poses=poses)

    return make


def _part(start: float, stop: float) -> Callable[[Given, Bases], Given]:
    """The rows between two shares of the take, numbered from 0, beside all of the video."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        rows = slice(int(start * len(given.points)), int(stop * len(given.points)))
        return given.with_(points=given.points[rows], frames=np.arange(len(given.points[rows])))

    return make


def _slowed(times: float) -> Callable[[Given, Bases], Given]:
    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        return given.with_(points=given.points[(np.arange(len(given.points)) / times).astype(int)])

    return make


def _copied(layout: Any) -> Callable[..., np.ndarray]:
    to, of = (layout.indices([f"{side}_{part}" for part in ("knee", "ankle")]) for side in "rl")
    hips = layout.indices(["r_hip", "l_hip"])

    def change(points: np.ndarray, *_: Any) -> np.ndarray:
        points[:, to] = points[:, of] + (points[:, hips[:1]] - points[:, hips[1:]])
        return points

    return change


def _smooth(frames: int) -> Callable[..., np.ndarray]:
    return lambda points, *_: uniform_filter1d(points, frames, axis=0, mode="nearest")


def _exchanged(points: np.ndarray, layout: Layout) -> np.ndarray:
    """Left and right, by their names."""
    swapped = [
        layout.index({"l": "r_", "r": "l_"}[n[0]] + n[2:] if n[1] == "_" else n) for n in layout.joints
    ]
    return points[:, swapped]


def _filled(rows: int, held: bool = False) -> Callable[..., np.ndarray]:
    """Every so often all limbs are lost for some rows; the gap is filled by straight lines, or by the last value."""

    def change(points: np.ndarray, *_: Any) -> np.ndarray:
        layout = COCO17 if points.shape[-1] == 2 else H36M17
        limbs = [
            i for i, name in enumerate(layout.joints) if name.endswith(("knee", "ankle", "elbow", "wrist"))
        ]
        for first in range(5, len(points) - rows - 1, 2 * rows + 5):
            share = np.arange(1, rows + 1)[:, None, None] / (rows + 1) * (not held)
            start, stop = points[first - 1, limbs], points[first + rows, limbs]
            points[first : first + rows, limbs] = (1 - share) * start + share * stop
        return points

    return change


def _at(rate: float, points: bool = True, poses: bool = False) -> Callable[[Given, Bases], Given]:
    """The rows of so many times the rate, between the old ones on lines, numbered one after another."""

    def made(values: np.ndarray | None, use: bool, rows: np.ndarray) -> np.ndarray | None:
        if values is None or not use:
            return None if values is None else values[: len(rows)]
        flat = values.reshape(len(values), -1)
        columns = [np.interp(rows, np.arange(len(values)), column) for column in flat.T]
        return np.stack(columns, axis=-1).reshape(len(rows), *values.shape[1:])

    def make(given: Given, _: Bases) -> Given:
        rows = np.arange(0, len(given.frames) - 1, 1 / rate)
        rows = rows[: len(given.frames)] if not (points and poses) else rows
        frames = np.arange(len(rows))
        changed = given.with_(points=made(given.points, points, rows), poses=made(given.poses, poses, rows))
        return changed.with_(frames=frames, video=given.video if points and given.poses is None else None)

    return make


def _one_point(joint: str, other: str) -> Callable[..., np.ndarray]:
    def change(points: np.ndarray, *_: Any) -> np.ndarray:
        layout = COCO17 if points.shape[-1] == 2 else H36M17
        points[:, layout.index(joint)] = points[:, layout.index(other)]
        return points

    return change


def _again(given: Given, _: Bases) -> Given:
    """The second half is the first once more."""
    half = len(given.frames) // 2
    rows = np.concatenate([np.arange(half), np.arange(half)])
    return given.with_(
        frames=np.arange(len(rows)),
        points=None if given.points is None else given.points[rows],
        poses=None if given.poses is None else given.poses[rows],
        video=None,
    )


def _hole(given: Given, _: Bases) -> Given:
    words = {name: value for name, value in given.words.items() if name != "fps"}
    return given.with_(points=None, time_s=given.frames / 30 + 3600.0 * (given.frames > 40), words=words)


def _less(share: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda joints: joints.mean(axis=0) + share * (joints - joints.mean(axis=0))


LIFTED: dict[str, tuple[Any, tuple[str, ...]]] = {
    "60 frames a second told of 30": (told_rate(60.0), CLOCK),
    "15 told of 30": (told_rate(15.0), CLOCK),
    "every second frame kept, numbers lost": (_every(2, 1), CLOCK),
    "every fifth frame dropped, numbers lost": (_every(5, 4), CLOCK),
    "ten in a row dropped, numbers lost": (
        lambda given, _: kept_rows(given, np.delete(np.arange(len(given.frames)), slice(30, 40))),
        (*CLOCK, *PEOPLE),
    ),
    "in a loop, three times": (
        lambda given, _: kept_rows(given, np.tile(np.arange(len(given.frames)), 3)),
        ("repeats-itself", *PEOPLE),
    ),
    "backwards": (lambda given, _: kept_rows(given, np.arange(len(given.frames))[::-1]), CLOCK),
    "shuffled": (
        lambda given, _: kept_rows(given, np.random.default_rng(0).permutation(len(given.frames))),
        (*PEOPLE, *CLOCK, *SHAPE, "only-noise"),
    ),
    "mirrored": (_points(lambda xy, size: np.stack([size[0] - xy[..., 0], xy[..., 1]], axis=-1)), SIDES),
    "left and right exchanged": (
        lambda given, _: given.with_(points=_exchanged(given.points, COCO17), video=None),
        SIDES,
    ),
    "image 1.33 times as wide": (resized(1.33, 1.0), SHAPE),
    "image 1.33 times as high": (resized(1.0, 1.33), SHAPE),
    "on its side": (_turned, UP),
    "upside down": (_points(lambda xy, size: size - xy), UP),
    "two people of one ID": (_two, (*PEOPLE, *SHAPE)),
    "smoothed over 31 frames": (_points(_smooth(31)), (*SHAPE, "keypoints-smooth")),
    "right leg a copy of the left": (_points(_copied(COCO17)), SHAPE),
    "shares of the image as pixels": (_points(lambda xy, size: xy / size), (*SHAPE, *TOGETHER)),
    "focal length told 2.2 times too long": (focal_times(2.2), ("focal-against-lines",)),
    "height told in centimetres": (_told(stature=175.0), ("stature",)),
    "ankles exchanged": (_points(sides_of("ankle")), (*GAPS, *SIDES)),
    "knees exchanged": (_points(sides_of("knee")), (*GAPS, *SIDES)),
    "wrists exchanged": (_points(sides_of("wrist")), (*GAPS, *SIDES)),
    "gaps of 15 frames filled by lines": (_points(_filled(15)), GAPS),
    "gaps of 15 frames filled by the last value": (_points(_filled(15, held=True)), GAPS),
    "right wrist at the nose": (_points(_one_point("r_wrist", "nose")), GAPS),
    "left knee at the left hip": (_points(_one_point("l_knee", "l_hip")), GAPS),
    "second half a copy of the first": (_again, ("repeats-itself", *PEOPLE)),
    "rows put between by lines, told of 30": (_at(2.0), (*GAPS, *CLOCK)),
    "made into 50 frames a second by lines, told of 30": (_at(50 / 30), (*GAPS, *CLOCK, *TOGETHER)),
    "18 frames a second told of 30": (told_rate(18.0), CLOCK),
    "trimmed": (lambda given, _: kept_rows(given, np.arange(10, len(given.frames) - 3)), ()),
    "half of the pixels": (resized(0.5, 0.5), ()),
}
POSES: dict[str, tuple[Any, tuple[str, ...]]] = {
    "depth of 30 %": (_poses(lambda joints: joints * (1, 1, 0.3)), (*SHAPE, *TOGETHER)),
    "depth of 60 %": (_poses(lambda joints: joints * (1, 1, 0.6), True), SHAPE),
    "depth of 200 %": (_poses(lambda joints: joints * (1, 1, 2.0), True), SHAPE),
    "half of the movement": (_poses(_less(0.5)), (*SHAPE, *TOGETHER)),
    "a tenth of the movement": (_poses(_less(0.1)), (*SHAPE, *TOGETHER)),
    "half of the movement, alone": (_poses(_less(0.5), True), SHAPE),
    "smoothed over 15 frames": (_poses(_smooth(15), True), SHAPE),
    "smoothed over 31 frames": (_poses(_smooth(31), True), SHAPE),
    "right leg a copy of the left": (_poses(_copied(H36M17), True), SHAPE),
    "mirrored": (_poses(lambda joints: joints * (-1, 1, 1), True), SIDES),
    "depth turned over": (_poses(lambda joints: joints * (1, 1, -1), True), SIDES),
    "up turned over": (_poses(lambda joints: joints * (1, -1, 1), True), (*UP, *SIDES)),
    "left and right exchanged": (_poses(lambda joints: _exchanged(joints, H36M17), True), SIDES),
    "one pose and 3 mm of noise": (
        _poses(lambda j: j[:1] + np.random.default_rng(0).normal(0, 0.003, j.shape), True), ("only-noise",)
    ),
    "metres told as millimetres": (lambda given, _: given.with_(unit="mm", points=None), ("stature", *SHAPE)),
    "z up told as a camera's": (
        _poses(lambda joints: np.stack([joints[..., 0], joints[..., 2], -joints[..., 1]], -1), True), (*UP, *SIDES)
    ),
    "a hole of an hour": (
        _hole,
        ("images-lacking",),
    ),
    "2 rows late": (_late(2), TOGETHER),
    "5 rows late": (_late(5), TOGETHER),
    "60 frames a second told of 30": (told_rate(60.0), CLOCK),
    "made at 25 frames a second, keypoints of 30": (_at(25 / 30, points=False, poses=True), TOGETHER),
    "beside keypoints of 25 frames a second": (_at(25 / 30), TOGETHER),
    "ankles exchanged": (_poses(sides_of("ankle"), True), (*GAPS, *SIDES)),
    "knees exchanged": (_poses(sides_of("knee"), True), (*GAPS, *SIDES)),
    "gaps of 15 frames filled by lines": (_poses(_filled(15), True), GAPS),
    "right wrist at the nose": (_poses(_one_point("r_wrist", "nose"), True), GAPS),
    "second half a copy of the first": (_again, ("repeats-itself", *PEOPLE)),
    "in a loop, three times": (
        lambda given, _: kept_rows(given.with_(points=None), np.tile(np.arange(len(given.frames)), 3)),
        ("repeats-itself", *PEOPLE),
    ),
}  # fmt: skip
FILMED: dict[str, tuple[Any, tuple[str, ...]]] = {
    "keypoints of another recording": (_of_other, TOGETHER),
    "keypoints of the mirrored video": (
        _points(lambda xy, size: np.stack([size[0] - xy[..., 0], xy[..., 1]], axis=-1), True),
        (*TOGETHER, *SIDES),
    ),
    "keypoints of the video backwards": (
        lambda given, _: given.with_(points=None if given.points is None else given.points[::-1]),
        TOGETHER,
    ),
    "keypoints of the video slowed by 4": (_slowed(4.0), (*TOGETHER, *CLOCK)),
    "keypoints of the video slowed by 2": (_slowed(2.0), (*TOGETHER, *CLOCK)),
    "keypoints made at 25 frames a second": (_at(25 / 30), TOGETHER),
    "keypoints made at 24 frames a second": (_at(24 / 30), TOGETHER),
    "keypoints 2 rows late": (_late(2), TOGETHER),
    "keypoints 3 rows late": (_late(3), TOGETHER),
    "keypoints 5 rows early": (_late(-5), TOGETHER),
    "keypoints of a part, numbered from 0": (_part(0.3, 0.8), TOGETHER),
}
