"""Sixty more accidents, each of two recordings. Of the first forty rules were chosen by every second one, and the
others looked at; the last twenty were written after all rules, and looked at once.

{name: (recordings, what is done, the codes of which one has to tell it)}, as in edits.py.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from pcnet3d.pipeline.core.layouts import COCO17, H36M17, Layout

from .material import Bases, Given

_LIMBS = ("knee", "ankle", "elbow", "wrist")


def layout_of(points: np.ndarray) -> Layout:
    """COCO's of points in 2D, Human3.6M's in 3D."""
    return COCO17 if points.shape[-1] == 2 else H36M17


def kept_rows(given: Given, rows: np.ndarray, **changes: Any) -> Given:
    """These rows as if they followed one another, their numbers lost; without the video, unless it is given."""
    return given.with_(
        frames=np.arange(len(rows)),
        points=None if given.points is None else given.points[rows],
        poses=None if given.poses is None else given.poses[rows],
        **{"video": None} | changes,
    )


def of_points(change: Callable[[np.ndarray], np.ndarray], video: bool = False) -> Callable[..., Given]:
    """change: of pixels (T, 17, 2)."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        points = np.concatenate([change(given.points[..., :2].copy()), given.points[..., 2:]], axis=-1)
        return given.with_(points=points, video=given.video if video else None)

    return make


def of_poses(change: Callable[[np.ndarray], np.ndarray], alone: bool = True) -> Callable[..., Given]:
    """change: of joints (T, 17, 3). alone: whether the keypoints are left out."""

    def make(given: Given, _: Bases) -> Given:
        assert given.poses is not None
        return given.with_(poses=change(given.poses.copy()), points=None if alone else given.points)

    return make


def _permuted(**of: str) -> Callable[[np.ndarray], np.ndarray]:
    """joint=other: the joint's column holds the other one."""

    def change(points: np.ndarray) -> np.ndarray:
        layout = layout_of(points)
        new = points.copy()
        new[:, layout.indices(list(of))] = points[:, layout.indices(list(of.values()))]
        return new

    return change


def sides_of(*parts: str, of_half: bool = False) -> Callable[[np.ndarray], np.ndarray]:
    """Left and right of these joints exchanged, in all rows or from the middle on."""
    both = {f"{a}_{part}": f"{b}_{part}" for part in parts for a, b in ("lr", "rl")}

    def change(points: np.ndarray, *_: Any) -> np.ndarray:
        start = len(points) // 2 if of_half else 0
        points[start:] = _permuted(**both)(points[start:])
        return points

    return change


def _side_late(rows: int) -> Callable[[np.ndarray], np.ndarray]:
    """All joints of the left side so many rows late."""

    def change(points: np.ndarray) -> np.ndarray:
        left = [i for i, name in enumerate(layout_of(points).joints) if name.startswith("l_")]
        points[rows:, left] = points[:-rows, left]
        return points

    return change


def _lost(fill: Callable[[np.ndarray], np.ndarray], every: int = 20, rows: int = 6) -> Callable[..., Any]:
    """Limbs of one side are lost for some rows every so often; fill: of points (T, 17, D), what stands there then."""

    def change(points: np.ndarray) -> np.ndarray:
        layout = layout_of(points)
        limbs = layout.indices([f"{side}_{part}" for side in "lr" for part in _LIMBS])
        filled = fill(points)
        for first in range(5, len(points) - rows, every):
            points[first : first + rows, limbs] = filled[first : first + rows, limbs]
        return points

    return change


def _rotated(degrees: float, axes: tuple[int, int] = (0, 1)) -> Callable[[np.ndarray], np.ndarray]:
    """About the middle of all points, in this plane."""

    def change(points: np.ndarray) -> np.ndarray:
        sin, cos = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        middle = points.mean(axis=(0, 1)) if points.shape[-1] == 2 else np.zeros(3)
        at = points - middle
        a, b = axes
        at[..., a], at[..., b] = cos * at[..., a] - sin * at[..., b], sin * at[..., a] + cos * at[..., b]
        return at + middle

    return change


def resized(x: float, y: float, size_too: bool = True, video: bool = False) -> Callable[..., Given]:
    """Pixels so many times as wide and high, and the image's size with them."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        size = tuple(int(side) for side in given.size * (x, y))
        words = given.words | {"image_size": size} if size_too else given.words
        return given.with_(points=given.points * (x, y, 1), words=words, video=given.video if video else None)

    return make


def _arm_of_other(given: Given, bases: Bases) -> Given:
    """The right arm is another recording's, hung on this shoulder."""
    other = bases["accad-m1_lift-box"].points
    assert given.points is not None
    assert other is not None
    points, arm = given.points.copy(), COCO17.indices(["r_elbow", "r_wrist"])
    shoulder = COCO17.index("r_shoulder")
    their = np.resize(other, points.shape)
    size = np.ptp(points[..., 1]) / np.ptp(their[..., 1])
    points[:, arm, :2] = points[:, [shoulder], :2] + size * (their[:, arm, :2] - their[:, [shoulder], :2])
    return given.with_(points=points, video=None)


def _of_other(name: str) -> Callable[..., Given]:
    """Keypoints of another recording, made to fill the same part of the image in every row."""

    def make(given: Given, bases: Bases) -> Given:
        assert given.points is not None
        other = np.resize(np.asarray(bases[name].points), given.points.shape)
        points = given.points.copy()
        low, high = points[..., :2].min(axis=1, keepdims=True), points[..., :2].max(axis=1, keepdims=True)
        their_low, their_high = (
            other[..., :2].min(axis=1, keepdims=True),
            other[..., :2].max(axis=1, keepdims=True),
        )
        size = (high - low)[..., 1:] / (their_high - their_low)[..., 1:]
        points[..., :2] = (low + high) / 2 + size * (other[..., :2] - (their_low + their_high) / 2)
        return given.with_(points=points)

    return make


def _alternating(given: Given, _: Bases) -> Given:
    """Every second stretch of 20 rows is somebody beside them, who is nearer to the camera."""
    assert given.points is not None
    points = given.points.copy()
    rows = np.arange(len(points)) // 20 % 2 == 1
    middle = points[:, :, :2].mean(axis=(0, 1))
    points[rows, :, :2] = middle + 1.4 * (points[rows, :, :2] - middle) + (0.15 * given.size[0], 0)
    return given.with_(points=points, video=None)


def _repeated(times: int) -> Callable[..., Given]:
    """Every row so many times, numbered one after another."""
    return lambda given, _: kept_rows(given, np.repeat(np.arange(len(given.frames)), times))


def _held(rows: int, video: bool = False) -> Callable[..., Given]:
    """Every so many-th row is held until the next."""
    return lambda given, _: given.with_(
        points=None if given.points is None else given.points[np.arange(len(given.points)) // rows * rows],
        poses=None if given.poses is None else given.poses[np.arange(len(given.poses)) // rows * rows],
        video=given.video if video else None,
    )


def _frozen_end(given: Given, _: Bases) -> Given:
    """From the middle on the row there is held."""
    assert given.points is not None
    points = given.points.copy()
    middle = len(points) // 2
    points[middle:] = points[middle]
    return given.with_(points=points, video=None)


def _mixed(factor: float, of: str) -> Callable[..., Given]:
    """The second half in another unit."""

    def make(given: Given, _: Bases) -> Given:
        values = given.points if of == "points" else given.poses
        assert values is not None
        values = values.copy()
        values[len(values) // 2 :, :, : 2 if of == "points" else 3] *= factor
        if of == "points":
            return given.with_(points=values, video=None)
        return given.with_(poses=values, points=None)

    return make


def _legs(factor: float) -> Callable[[np.ndarray], np.ndarray]:
    """Legs so many times as long."""

    def change(joints: np.ndarray) -> np.ndarray:
        for side in "lr":
            hip, knee, ankle = H36M17.indices([f"{side}_{part}" for part in ("hip", "knee", "ankle")])
            joints[:, [knee, ankle]] = joints[:, [hip]] + factor * (
                joints[:, [knee, ankle]] - joints[:, [hip]]
            )
        return joints

    return change


def _one_negated(parts: tuple[str, ...], axis: int) -> Callable[[np.ndarray], np.ndarray]:
    """One axis of some joints negated about the pelvis."""

    def change(joints: np.ndarray) -> np.ndarray:
        joints[:, H36M17.indices(parts), axis] *= -1
        return joints

    return change


def _depth_lost(joints: np.ndarray) -> np.ndarray:
    """Depth of hands and feet as that of elbows and knees."""
    for side in "lr":
        for end, middle in (("ankle", "knee"), ("wrist", "elbow")):
            joints[:, H36M17.index(f"{side}_{end}"), 2] = joints[:, H36M17.index(f"{side}_{middle}"), 2]
    return joints


def _facing(joints: np.ndarray) -> np.ndarray:
    """Each row turned about the camera's vertical axis until it faces the camera, as of a body's own frame."""
    across = joints[:, H36M17.index("l_hip")] - joints[:, H36M17.index("r_hip")]
    angle = np.arctan2(across[:, 2], across[:, 0])
    sin, cos = np.sin(-angle)[:, None], np.cos(-angle)[:, None]
    x, z = joints[..., 0].copy(), joints[..., 2].copy()
    joints[..., 0], joints[..., 2] = cos * x - sin * z, sin * x + cos * z
    return joints


def _trailing(share: float) -> Callable[[np.ndarray], np.ndarray]:
    """Exponential smoothing, which lags."""

    def change(points: np.ndarray) -> np.ndarray:
        for row in range(1, len(points)):
            points[row] = share * points[row - 1] + (1 - share) * points[row]
        return points

    return change


def _moved(x: float, y: float) -> Callable[..., Given]:
    """By so many shares of the image, as of keypoints of a crop beside the whole video."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        shift = np.array([*(given.size * (x, y)), 0.0])
        return given.with_(points=given.points + shift)

    return make


def _growing(one_in: int) -> Callable[..., Given]:
    """One row in so many is lost, and the rest numbered one after another, beside the video."""
    return lambda given, _: kept_rows(
        given, np.flatnonzero(np.arange(len(given.frames)) % one_in != one_in - 1), video=given.video
    )


def _cut_out(start: float, rows: int) -> Callable[..., Given]:
    """So many rows are lost in one place, and the rest numbered one after another, beside the video."""

    def make(given: Given, _: Bases) -> Given:
        first = int(start * len(given.frames))
        kept = np.delete(np.arange(len(given.frames)), slice(first, first + rows))
        return kept_rows(given, kept, video=given.video)

    return make


def _slowly(rate: float) -> Callable[..., Given]:
    """Rows of so many times the rate, on lines between the old ones, with a detector's noise, numbered one after
    another beside the video."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        rows = np.arange(0, len(given.points) - 1, 1 / rate)
        flat = given.points.reshape(len(given.points), -1)
        made = np.stack([np.interp(rows, np.arange(len(flat)), column) for column in flat.T], axis=-1)
        points = made.reshape(len(rows), *given.points.shape[1:])[: len(given.points)]
        points[..., :2] += np.random.default_rng(0).normal(0, 0.3, points[..., :2].shape)
        return given.with_(points=points, frames=np.arange(len(points)))

    return make


def told_rate(fps: float) -> Callable[..., Given]:
    return lambda given, _: given.with_(words=given.words | {"fps": fps}, video=None)


def _late_joints(rows: int, *parts: str) -> Callable[[np.ndarray], np.ndarray]:
    """These joints of both sides so many rows late."""

    def change(points: np.ndarray) -> np.ndarray:
        late = layout_of(points).indices([f"{side}_{part}" for side in "lr" for part in parts])
        points[rows:, late] = points[:-rows, late]
        return points

    return change


def focal_times(factor: float) -> Callable[..., Given]:
    def make(given: Given, _: Bases) -> Given:
        focal = given.words.get("focal", 1.0 * max(given.words["image_size"]))
        return given.with_(words=given.words | {"focal": factor * focal})

    return make


def _pose_rate(rate: float) -> Callable[..., Given]:
    """Poses of so many times the rate of the keypoints beside them, numbered alike."""

    def make(given: Given, _: Bases) -> Given:
        assert given.poses is not None
        rows = np.arange(0, len(given.poses) - 1, 1 / rate)[: len(given.poses)]
        flat = given.poses.reshape(len(given.poses), -1)
        made = np.stack([np.interp(rows, np.arange(len(flat)), column) for column in flat.T], axis=-1)
        points = None if given.points is None else given.points[: len(rows)]
        return given.with_(poses=made.reshape(-1, 17, 3), points=points, frames=np.arange(len(rows)))

    return make


CLOCK = (
    "rate-against-movement", "rows-lost", "rows-added", "fps-contradicts", "duplicates",
    "gait-unlike-any-seen",
)  # fmt: skip
TOGETHER = ("keypoints-not-of-poses", "keypoints-not-of-video", "poses-against-keypoints")
SHAPE = (
    "depth-scaled", "bones", "flat", "stature", "limbs-copied", "left-and-right", "mirrored",
    "legs-against-arms", "body-unlike", "joints-exchanged", "joints-filled", "joints-coincide", "image-stretched",
    "poses-smooth",
)  # fmt: skip
SIDES = ("mirrored", "legs-against-arms", "left-and-right", "sides-doubtful", "joints-exchanged", *TOGETHER)
SWAPS = ("swaps-found", "swaps-doubtful", "swaps-masked", *SIDES)
UP = (
    "nobody-upright",
    "upside-down",
    "picture-upside-down",
    "on-its-side",
    "not-levelled",
    "image-against-bodies",
)
PEOPLE = ("leaps", "leap-between-people", "strays-removed", "people-by-poses-alone")
GAPS = ("joints-filled", "joints-coincide", "joints-exchanged", "duplicates", "images-lacking", "gaps")
_FILMS = ("walker", "walk_crop")
_WALKS = ("07_03", "walk_crop")
_POSES = ("07_03 poses", "accad-m1_lift-box poses")

SLIPS: dict[str, tuple[tuple[str, ...], Any, tuple[str, ...]]] = {
    "every third frame dropped, numbers lost": (
        ("07_03", "accad-m1_run"), lambda g, _: kept_rows(g, np.flatnonzero(np.arange(len(g.frames)) % 3 != 2)), CLOCK),
    "every row twice": (("07_03", "08_04"), _repeated(2), (*CLOCK, *GAPS)),
    "found in every third frame, and held": (("08_04", "accad-m1_run"), _held(3), (*CLOCK, *GAPS)),
    "second half the last row again": (("07_03", "tennis-jangel_Derecha_0"), _frozen_end, (*CLOCK, *GAPS)),
    "left side 4 rows late": (("07_03", "accad-m1_run"), of_points(_side_late(4)), (*SHAPE, *SWAPS)),
    "right knee and ankle in each other's column": (
        ("08_04", "accad-m1_lift-box"), of_points(_permuted(r_knee="r_ankle", r_ankle="r_knee")), (*SHAPE, *SIDES)),
    "left elbow and wrist in each other's column": (
        ("07_03", "accad-m1_run"), of_points(_permuted(l_elbow="l_wrist", l_wrist="l_elbow")), (*SHAPE, *SIDES)),
    "legs' sides exchanged": (
        ("07_03", "accad-m1_lift-box"), of_points(sides_of("hip", "knee", "ankle")), SIDES),
    "arms' sides exchanged": (
        ("08_04", "tennis-jangel_Derecha_0"), of_points(sides_of("shoulder", "elbow", "wrist")), SIDES),
    "legs' sides exchanged from the middle on": (
        ("07_03", "accad-m1_run"), of_points(sides_of("hip", "knee", "ankle", of_half=True)), SWAPS),
    "hips exchanged": (("07_03", "accad-m1_lift-box"), of_points(sides_of("hip")), SIDES),
    "ears and shoulders exchanged": (
        ("08_04", "walk_crop"),
        of_points(_permuted(l_ear="l_shoulder", l_shoulder="l_ear", r_ear="r_shoulder", r_shoulder="r_ear")), SHAPE),
    "y upwards": (
        ("08_04", "walk_crop"),
        lambda g, b: of_points(lambda xy: xy * (1, -1) + (0, g.size[1]))(g, b), (*UP, *SIDES)),
    "width squeezed to 0.6": (("07_03", "accad-m1_lift-box"), resized(0.6, 1.0), SHAPE),
    "height squeezed to 0.5625": (("08_04", "walk_crop"), resized(1.0, 0.5625), SHAPE),
    "rounded to 16 pixels": (
        ("07_03", "accad-m1_run"), of_points(lambda xy: 16 * np.round(xy / 16)), (*SHAPE, "rounded", "only-noise")),
    "smoothed over 11 frames": (
        ("08_04", "accad-m1_run"), of_points(lambda xy: uniform_filter1d(xy, 11, axis=0)),
        (*SHAPE, "keypoints-smooth")),
    "exponentially smoothed": (
        ("07_03", "accad-m1_run"), of_points(_trailing(0.85)), (*SHAPE, "keypoints-smooth")),
    "somebody else every 20 rows": (("07_03", "accad-m1_lift-box"), _alternating, PEOPLE),
    "right arm of another recording": (("07_03", "08_04"), _arm_of_other, (*SHAPE, *TOGETHER)),
    "second half in half the pixels": (("07_03", "accad-m1_lift-box"), _mixed(0.5, "points"), (*PEOPLE, *SHAPE)),
    "lost joints put at the image's corner": (("08_04", "accad-m1_lift-box"), of_points(_lost(np.zeros_like)), GAPS),
    "lost joints put at the body's middle": (
        ("07_03", "accad-m1_run"),
        of_points(_lost(lambda xy: np.broadcast_to(xy[:, 5:].mean(axis=1, keepdims=True), xy.shape))), GAPS),
    "rolled by 35 degrees": (("07_03", "08_04"), of_points(_rotated(35.0)), UP),
    "centimetres from the middle on": (_POSES, _mixed(100.0, "poses"), (*PEOPLE, *SHAPE)),
    "left leg's x negated": (_POSES, of_poses(_one_negated(("l_knee", "l_ankle"), 0)), (*SHAPE, *SIDES)),
    "x and depth exchanged": (_POSES, of_poses(lambda j: j[..., [2, 1, 0]]), (*SIDES, *SHAPE)),
    "hands and feet without depth": (_POSES, of_poses(_depth_lost), SHAPE),
    "legs 1.35 times as long": (_POSES, of_poses(_legs(1.35), alone=False), (*SHAPE, *TOGETHER)),
    "each row turned to the camera": (_POSES, of_poses(_facing, alone=False), TOGETHER),
    "rolled by 40 degrees, keypoints not": (_POSES, of_poses(_rotated(40.0), alone=False), TOGETHER),
    "rounded to 5 cm": (_POSES, of_poses(lambda j: 0.1 * np.round(j / 0.1)), (*SHAPE, "rounded")),
    "poses of 50 frames a second beside keypoints of 30": (_POSES, _pose_rate(50 / 30), TOGETHER),
    "keypoints of a crop": (_FILMS, _moved(-0.12, -0.1), TOGETHER),
    "keypoints lack one row in 16": (_FILMS, _growing(16), (*TOGETHER, *CLOCK)),
    "keypoints lack 12 rows in the middle": (_FILMS, _cut_out(0.45, 12), (*TOGETHER, *CLOCK, *PEOPLE)),
    "keypoints made at 50 frames a second": (_FILMS, _slowly(50 / 30), TOGETHER),
    "keypoints of another recording, in the same place": (_FILMS, _of_other("07_03"), TOGETHER),
    "keypoints of half the video's size": (_FILMS, resized(0.5, 0.5, size_too=False, video=True), TOGETHER),
    "focal length told 0.4 times": (_FILMS, focal_times(0.4), ("focal-against-lines", "image-against-bodies")),
}  # fmt: skip
CHOSEN_BY, LOOKED_AT_ONCE = list(SLIPS)[::2], list(SLIPS)[1::2]
# Written after all rules, and looked at once.
LAST: dict[str, tuple[tuple[str, ...], Any, tuple[str, ...]]] = {
    "every fourth frame dropped, numbers lost": (
        ("08_04", "accad-m1_run"), lambda g, _: kept_rows(g, np.flatnonzero(np.arange(len(g.frames)) % 4 != 3)), CLOCK),
    "20 frames a second told of 30": (_WALKS, told_rate(20.0), CLOCK),
    "50 frames a second told of 30": (("08_04", "accad-m1_run"), told_rate(50.0), CLOCK),
    "at half its rate and backwards": (
        ("07_03", "accad-m1_run"),
        lambda g, b: told_rate(15.0)(kept_rows(g, np.arange(len(g.frames))[::-1]), b), CLOCK),
    "width stretched to 1.5": (("07_03", "tennis-jangel_Derecha_0"), resized(1.5, 1.0), SHAPE),
    "height squeezed to 0.8": (("08_04", "accad-m1_run"), resized(1.0, 0.8), SHAPE),
    "elbows exchanged": (("07_03", "accad-m1_lift-box"), of_points(sides_of("elbow")), SIDES),
    "shoulders exchanged": (("08_04", "tennis-jangel_Derecha_0"), of_points(sides_of("shoulder")), SIDES),
    "right ankle and wrist in each other's column": (
        ("08_04", "accad-m1_run"), of_points(_permuted(r_ankle="r_wrist", r_wrist="r_ankle")), (*SHAPE, *SIDES)),
    "legs 10 rows late": (("07_03", "accad-m1_lift-box"), of_points(_late_joints(10, "knee", "ankle")), SHAPE),
    "every second row held": (("07_03", "tennis-jangel_Derecha_0"), _held(2), (*CLOCK, *GAPS)),
    "smoothed over 21 frames": (
        ("07_03", "accad-m1_lift-box"), of_points(lambda xy: uniform_filter1d(xy, 21, axis=0)),
        (*SHAPE, "keypoints-smooth")),
    "cut off at six tenths of the width": (
        ("08_04", "tennis-jangel_Derecha_0"),
        lambda g, b: of_points(lambda xy: np.minimum(xy, (0.6 * g.size[0], np.inf)))(g, b),
        (*GAPS, *SHAPE, "not-seen")),
    "poses smoothed over 21 frames": (_POSES, of_poses(lambda j: uniform_filter1d(j, 21, axis=0)), SHAPE),
    "poses with every third row held": (_POSES, _held(3), (*CLOCK, *GAPS)),
    "poses with arms' sides exchanged": (
        _POSES, of_poses(sides_of("shoulder", "elbow", "wrist")), SIDES),
    "poses with the left knee and ankle in each other's column": (
        _POSES, of_poses(_permuted(l_knee="l_ankle", l_ankle="l_knee")), (*SHAPE, *SIDES)),
    "poses of half the depth": (_POSES, of_poses(lambda j: j * (1, 1, 0.5)), SHAPE),
    "keypoints lack one row in 10": (_FILMS, _growing(10), (*TOGETHER, *CLOCK)),
    "keypoints shifted by a tenth of the width": (_FILMS, _moved(0.1, 0.0), TOGETHER),
}  # fmt: skip
