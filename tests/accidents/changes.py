"""What an accident does to what a user gives: each function makes a `Make`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from pcnet3d.pipeline.core.layouts import COCO17, H36M17, Layout

from .material import Bases, Given

Make = Callable[[Given, Bases], Given]
Change = Callable[
    [np.ndarray], np.ndarray
]  # of pixels (T, 17, 2) or joints (T, 17, 3), which it may overwrite
LIMBS = ("knee", "ankle", "elbow", "wrist")


def layout_of(points: np.ndarray) -> Layout:
    """COCO's of points in 2D, Human3.6M's in 3D."""
    return COCO17 if points.shape[-1] == 2 else H36M17


def _sided(layout: Layout) -> list[str]:
    """Its joints that are there on both sides, without the side."""
    return [name[2:] for name in layout.joints if name.startswith("l_")]


def of_points(change: Change, video: bool = False) -> Make:
    """Other pixels; the video beside them only where it is said."""
    return in_image(lambda points, _: change(points), video)


def in_image(change: Callable[[np.ndarray, np.ndarray], np.ndarray], video: bool = False) -> Make:
    """The same; change: of pixels by the image's size (2,)."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        moved = change(given.points[..., :2].copy(), given.size)
        points = np.concatenate([moved, given.points[..., 2:]], axis=-1)
        return given.with_(points=points, video=given.video if video else None)

    return make


def of_poses(change: Change, alone: bool = True) -> Make:
    """Other joints. alone: whether the keypoints are left out."""

    def make(given: Given, _: Bases) -> Given:
        assert given.poses is not None
        return given.with_(poses=change(given.poses.copy()), points=None if alone else given.points)

    return make


def told(**words: Any) -> Make:
    return lambda given, _: given.with_(words=given.words | words)


def told_rate(fps: float) -> Make:
    return lambda given, _: given.with_(words=given.words | {"fps": fps}, video=None)


def focal_times(factor: float) -> Make:
    def make(given: Given, _: Bases) -> Given:
        focal = given.words.get("focal", 1.0 * max(given.words["image_size"]))
        return given.with_(words=given.words | {"focal": factor * focal})

    return make


# Rows that are lost, repeated or of another time.


def kept(rows: Callable[[int], np.ndarray], video: bool = False) -> Make:
    """rows: which of so many follow one another, their numbers lost; the video beside them only where it is said."""

    def make(given: Given, _: Bases) -> Given:
        chosen = rows(len(given.frames))
        return given.with_(
            frames=np.arange(len(chosen)),
            points=None if given.points is None else given.points[chosen],
            poses=None if given.poses is None else given.poses[chosen],
            video=given.video if video else None,
        )

    return make


def every(step: int, of: int, video: bool = False) -> Make:
    """The first `of` in each `step` rows."""
    return kept(lambda count: np.flatnonzero(np.arange(count) % step < of), video)


def shown(rows: Callable[[np.ndarray], np.ndarray], video: bool = False) -> Make:
    """Each row has what another one had, and keeps its number; rows: the others (T,) by those (T,)."""

    def make(given: Given, _: Bases) -> Given:
        others = rows(np.arange(len(given.frames)))
        return given.with_(
            points=None if given.points is None else given.points[others],
            poses=None if given.poses is None else given.poses[others],
            video=given.video if video else None,
        )

    return make


def late(rows: int) -> Make:
    """Keypoints so many rows late, or early, against poses or the video."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        rest = slice(max(rows, 0), None)
        points = np.roll(given.points, rows, axis=0)[rest]
        poses = None if given.poses is None else given.poses[rest]
        return given.with_(points=points, frames=given.frames[rest], poses=poses)

    return make


def joints_late(rows: int, *parts: str, sides: str = "lr") -> Change:
    """These joints of these sides so many rows late, all where none is named."""

    def change(points: np.ndarray) -> np.ndarray:
        layout = layout_of(points)
        chosen = layout.indices([f"{side}_{each}" for side in sides for each in parts or _sided(layout)])
        points[rows:, chosen] = points[:-rows, chosen]
        return points

    return change


def part(start: float, stop: float) -> Make:
    """The rows between two shares of the take, numbered from 0, beside all of the video."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        rows = slice(int(start * len(given.points)), int(stop * len(given.points)))
        return given.with_(points=given.points[rows], frames=np.arange(len(given.points[rows])))

    return make


def _between(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(R, ...) at rows (R,) between those of (T, ...), on lines."""
    columns = values.reshape(len(values), -1).T
    made = [np.interp(rows, np.arange(len(values)), column) for column in columns]
    return np.stack(made, axis=-1).reshape(len(rows), *values.shape[1:])


def at_rate(rate: float, points: bool = True, poses: bool = False, noise_px: float = 0.0) -> Make:
    """Points, poses or both at so many times the rate, between the old rows on lines, with a detector's noise, numbered
    one after another; the video beside keypoints alone."""

    def make(given: Given, _: Bases) -> Given:
        rows = np.arange(0, len(given.frames) - 1, 1 / rate)[: len(given.frames)]
        made = {
            name: _between(values, rows) if use else values[: len(rows)]
            for name, use in (("points", points), ("poses", poses))
            if (values := getattr(given, name)) is not None
        }
        if noise_px:
            made["points"][..., :2] += np.random.default_rng(0).normal(
                0, noise_px, made["points"][..., :2].shape
            )
        video = given.video if points and given.poses is None else None
        return given.with_(frames=np.arange(len(rows)), video=video, **made)

    return make


def hole(given: Given, _: Bases) -> Given:
    """An hour is lost."""
    words = {name: value for name, value in given.words.items() if name != "fps"}
    return given.with_(points=None, time_s=given.frames / 30 + 3600.0 * (given.frames > 40), words=words)


# Joints in another's place.


def permuted(**of: str) -> Change:
    """joint=other: the joint's column holds the other one."""

    def change(points: np.ndarray) -> np.ndarray:
        layout = layout_of(points)
        new = points.copy()
        new[:, layout.indices(list(of))] = points[:, layout.indices(list(of.values()))]
        return new

    return change


def sides_of(*parts: str, of_half: bool = False) -> Change:
    """Left and right of these joints, of all where none is named, exchanged in all rows or from the middle on."""

    def change(points: np.ndarray) -> np.ndarray:
        named = parts or _sided(layout_of(points))
        both = {f"{a}_{each}": f"{b}_{each}" for each in named for a, b in ("lr", "rl")}
        start = len(points) // 2 if of_half else 0
        points[start:] = permuted(**both)(points[start:])
        return points

    return change


def sides_and_scores(given: Given, _: Bases) -> Given:
    """Left and right of all keypoints exchanged with their scores."""
    assert given.points is not None
    points, scores = (sides_of()(given.points[..., part].copy()) for part in (slice(2), [2, 2]))
    return given.with_(points=np.concatenate([points, scores[..., :1]], axis=-1), video=None)


def leg_copied(points: np.ndarray) -> np.ndarray:
    """The right leg is the left one, moved to its hip."""
    layout = layout_of(points)
    to, of = (layout.indices([f"{side}_{each}" for each in ("knee", "ankle")]) for side in "rl")
    hips = layout.indices(["r_hip", "l_hip"])
    points[:, to] = points[:, of] + (points[:, hips[:1]] - points[:, hips[1:]])
    return points


def lost(fill: Callable[[np.ndarray, int, int], np.ndarray], rows: int, apart: int) -> Change:
    """Limbs are lost for some rows every so often; fill: of all points, the first row and the one behind the last ->
    (rows, 17, D) what stands there then."""

    def change(points: np.ndarray) -> np.ndarray:
        limbs = layout_of(points).indices([f"{side}_{each}" for side in "lr" for each in LIMBS])
        old = points.copy()
        for first in range(5, len(points) - rows, apart):
            points[first : first + rows, limbs] = fill(old, first, first + rows)[:, limbs]
        return points

    return change


def by_lines(points: np.ndarray, first: int, end: int) -> np.ndarray:
    """Of `lost`: on lines from the row before to the row behind."""
    share = (np.arange(first, end) - first + 1)[:, None, None] / (end - first + 1)
    return (1 - share) * points[first - 1] + share * points[end]


def by_last(points: np.ndarray, first: int, end: int) -> np.ndarray:
    """Of `lost`: the row before."""
    return np.repeat(points[first - 1 : first], end - first, axis=0)


def by_middle(points: np.ndarray, first: int, end: int) -> np.ndarray:
    """Of `lost`: the body's middle."""
    body = points[first:end]
    return np.broadcast_to(body[:, 5:].mean(axis=1, keepdims=True), body.shape)


# Another shape, size or place.


def smooth(frames: int, mode: str = "reflect") -> Change:
    return lambda points: uniform_filter1d(points, frames, axis=0, mode=mode)


def trailing(share: float) -> Change:
    """Exponential smoothing, which lags."""

    def change(points: np.ndarray) -> np.ndarray:
        for row in range(1, len(points)):
            points[row] = share * points[row - 1] + (1 - share) * points[row]
        return points

    return change


def rotated(degrees: float) -> Change:
    """In the image's plane, about the middle of all points."""

    def change(points: np.ndarray) -> np.ndarray:
        sin, cos = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
        middle = points.mean(axis=(0, 1)) if points.shape[-1] == 2 else np.zeros(3)
        at = points - middle
        at[..., 0], at[..., 1] = cos * at[..., 0] - sin * at[..., 1], sin * at[..., 0] + cos * at[..., 1]
        return at + middle

    return change


def resized(x: float, y: float, size_too: bool = True, video: bool = False) -> Make:
    """Pixels so many times as wide and high, and the image's size with them."""

    def make(given: Given, _: Bases) -> Given:
        assert given.points is not None
        size = tuple(int(side) for side in given.size * (x, y))
        words = given.words | {"image_size": size} if size_too else given.words
        return given.with_(points=given.points * (x, y, 1), words=words, video=given.video if video else None)

    return make


def turned(given: Given, _: Bases) -> Given:
    """The image lies on its side."""
    assert given.points is not None
    width, height = given.words["image_size"]
    x, y, score = np.moveaxis(given.points, -1, 0)
    points = np.stack([height - y, x, score], axis=-1)
    return given.with_(points=points, words=given.words | {"image_size": (height, width)}, video=None)


def moved(x: float, y: float) -> Make:
    """By so many shares of the image, as of keypoints of a crop beside the whole video."""
    return in_image(lambda points, size: points + size * (x, y), video=True)


def half_in_another_unit(factor: float) -> Change:
    """From the middle on."""

    def change(points: np.ndarray) -> np.ndarray:
        points[len(points) // 2 :] *= factor
        return points

    return change


def less(share: float) -> Change:
    """The movement about the mean pose so many times as large."""
    return lambda joints: joints.mean(axis=0) + share * (joints - joints.mean(axis=0))


def legs(factor: float) -> Change:
    """Legs so many times as long."""

    def change(joints: np.ndarray) -> np.ndarray:
        for side in "lr":
            hip, *below = H36M17.indices([f"{side}_{each}" for each in ("hip", "knee", "ankle")])
            joints[:, below] = joints[:, [hip]] + factor * (joints[:, below] - joints[:, [hip]])
        return joints

    return change


def left_leg_negated(joints: np.ndarray) -> np.ndarray:
    """Its x, about the pelvis."""
    joints[:, H36M17.indices(("l_knee", "l_ankle")), 0] *= -1
    return joints


def depth_lost(joints: np.ndarray) -> np.ndarray:
    """Depth of hands and feet as that of elbows and knees."""
    for side in "lr":
        for end, middle in (("ankle", "knee"), ("wrist", "elbow")):
            joints[:, H36M17.index(f"{side}_{end}"), 2] = joints[:, H36M17.index(f"{side}_{middle}"), 2]
    return joints


def facing(joints: np.ndarray) -> np.ndarray:
    """Each row turned about the camera's vertical axis until it faces the camera, as of a body's own frame."""
    across = joints[:, H36M17.index("l_hip")] - joints[:, H36M17.index("r_hip")]
    angle = np.arctan2(across[:, 2], across[:, 0])
    sin, cos = np.sin(-angle)[:, None], np.cos(-angle)[:, None]
    x, z = joints[..., 0].copy(), joints[..., 2].copy()
    joints[..., 0], joints[..., 2] = cos * x - sin * z, sin * x + cos * z
    return joints


# Other people.


def two_people(points: np.ndarray, size: np.ndarray) -> np.ndarray:
    """The second half is another person's, to the side."""
    middle = len(points) // 2
    aside = 0.4 * size[0] * (points[middle, 5, 0] < size[0] / 2)
    points[middle:] = 0.6 * points[middle:] + (aside, 0)
    return points


def alternating(points: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Every second stretch of 20 rows is somebody beside them, who is nearer to the camera."""
    rows = np.arange(len(points)) // 20 % 2 == 1
    middle = points.mean(axis=(0, 1))
    points[rows] = middle + 1.4 * (points[rows] - middle) + (0.15 * size[0], 0)
    return points


def of_other(given: Given, bases: Bases) -> Given:
    """Keypoints of another recording, about as large and in the same place on the whole."""
    assert given.points is not None
    points = np.resize(np.asarray(bases["08_04"].points), given.points.shape)
    scale = np.ptp(given.points[..., 1]) / max(np.ptp(points[..., 1]), 1.0)
    about, to = points[..., :2].mean(axis=(0, 1)), given.points[..., :2].mean(axis=(0, 1))
    points[..., :2] = (points[..., :2] - about) * scale + to
    return given.with_(points=points)


def of_other_in_place(given: Given, bases: Bases) -> Given:
    """Keypoints of another recording, made to fill the same part of the image in every row."""
    assert given.points is not None
    other = np.resize(np.asarray(bases["07_03"].points), given.points.shape)

    def ends(of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return of[..., :2].min(axis=1, keepdims=True), of[..., :2].max(axis=1, keepdims=True)

    points, (low, high), (their_low, their_high) = given.points.copy(), ends(given.points), ends(other)
    size = (high - low)[..., 1:] / (their_high - their_low)[..., 1:]
    points[..., :2] = (low + high) / 2 + size * (other[..., :2] - (their_low + their_high) / 2)
    return given.with_(points=points)


def arm_of_other(given: Given, bases: Bases) -> Given:
    """The right arm is another recording's, hung on this shoulder."""
    assert given.points is not None
    points, arm = given.points.copy(), COCO17.indices(["r_elbow", "r_wrist"])
    shoulder = COCO17.index("r_shoulder")
    their = np.resize(np.asarray(bases["accad-m1_lift-box"].points), points.shape)
    size = np.ptp(points[..., 1]) / np.ptp(their[..., 1])
    points[:, arm, :2] = points[:, [shoulder], :2] + size * (their[:, arm, :2] - their[:, [shoulder], :2])
    return given.with_(points=points, video=None)
