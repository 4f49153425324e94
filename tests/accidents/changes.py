"""What an accident does to what a user gives: each function makes a `Make`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from pcnet3d.pipeline.core.layouts import COCO17, H36M17, Layout

from .material import Bases, Given

Make = Callable[[Given, Bases], Given]
Change = Callable[[np.ndarray], np.ndarray]  # of pixels (T, 17, 2) or joints (T, 17, 3), which it may alter
LIMBS = ("knee", "ankle", "elbow", "wrist")


def told_before(function: Callable[..., Any]) -> Callable[..., Any]:
    """function(value, *words) by its words alone: told_before(function)(*words) is a Make or a Change."""
    return lambda *words, **named: lambda value, *_: function(value, *words, **named)


def layout_of(points: np.ndarray) -> Layout:
    """COCO's of points in 2D, Human3.6M's in 3D."""
    return COCO17 if points.shape[-1] == 2 else H36M17


def _sided(layout: Layout) -> list[str]:
    """Its joints that are there on both sides, without the side."""
    return [name[2:] for name in layout.joints if name.startswith("l_")]


def of_points(change: Change, video: bool = False) -> Make:
    """Other pixels; the video beside them only where it is said."""
    return in_image(lambda points, _: change(points), video)


@told_before
def in_image(
    given: Given, change: Callable[[np.ndarray, np.ndarray], np.ndarray], video: bool = False
) -> Given:
    """The same; change: of pixels by the image's size (2,)."""
    moved = change(given.points[..., :2].copy(), given.size)
    points = np.concatenate([moved, given.points[..., 2:]], axis=-1)
    return given.with_(points=points, video=given.video if video else None)


@told_before
def of_poses(given: Given, change: Change, alone: bool = True) -> Given:
    """Other joints. alone: whether the keypoints are left out."""
    return given.with_(poses=change(given.poses.copy()), points=None if alone else given.points)


@told_before
def told(given: Given, **words: Any) -> Given:
    return given.with_(words=given.words | words)


@told_before
def told_rate(given: Given, fps: float) -> Given:
    return given.with_(words=given.words | {"fps": fps}, video=None)


@told_before
def focal_times(given: Given, factor: float) -> Given:
    focal = given.words.get("focal", 1.0 * max(given.words["image_size"]))
    return given.with_(words=given.words | {"focal": factor * focal})


# Rows that are lost, repeated or of another time.


@told_before
def kept(given: Given, rows: Callable[[int], np.ndarray], video: bool = False) -> Given:
    """rows: which of so many follow one another, their numbers lost; the video beside them only where it is said."""
    chosen = rows(len(given.frames))
    return given.at(chosen, frames=np.arange(len(chosen)), video=given.video if video else None)


def every(step: int, of: int, video: bool = False) -> Make:
    """The first `of` in each `step` rows."""
    return kept(lambda count: np.flatnonzero(np.arange(count) % step < of), video)


@told_before
def shown(given: Given, rows: Callable[[np.ndarray], np.ndarray], video: bool = False) -> Given:
    """Each row has what another one had, and keeps its number; rows: the others (T,) by those (T,)."""
    return given.at(rows(np.arange(len(given.frames))), video=given.video if video else None)


@told_before
def late(given: Given, rows: int) -> Given:
    """Keypoints so many rows late, or early, against poses or the video."""
    rest = slice(max(rows, 0), None)
    return given.with_(points=np.roll(given.points, rows, axis=0)).at(rest, frames=given.frames[rest])


@told_before
def joints_late(points: np.ndarray, rows: int, *parts: str, sides: str = "lr") -> np.ndarray:
    """These joints of these sides so many rows late, all where none is named."""
    layout = layout_of(points)
    chosen = layout.indices([f"{side}_{each}" for side in sides for each in parts or _sided(layout)])
    points[rows:, chosen] = points[:-rows, chosen]
    return points


@told_before
def part(given: Given, start: float, stop: float) -> Given:
    """The rows between two shares of the take, numbered from 0, beside all of the video."""
    rows = slice(int(start * len(given.points)), int(stop * len(given.points)))
    return given.at(rows, frames=np.arange(len(given.points[rows])))


def _between(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """(R, ...) at rows (R,) between those of (T, ...), on lines."""
    columns = values.reshape(len(values), -1).T
    made = [np.interp(rows, np.arange(len(values)), column) for column in columns]
    return np.stack(made, axis=-1).reshape(len(rows), *values.shape[1:])


@told_before
def at_rate(
    given: Given, rate: float, points: bool = True, poses: bool = False, noise_px: float = 0.0
) -> Given:
    """Points, poses or both at so many times the rate, between the old rows on lines, with a detector's noise, numbered
    one after another; the video beside keypoints alone."""
    rows = np.arange(0, len(given.frames) - 1, 1 / rate)[: len(given.frames)]
    made = {
        name: _between(values, rows) if use else values[: len(rows)]
        for name, use in (("points", points), ("poses", poses))
        if (values := getattr(given, name)) is not None
    }
    if noise_px:
        made["points"][..., :2] += np.random.default_rng(0).normal(0, noise_px, made["points"][..., :2].shape)
    video = given.video if points and given.poses is None else None
    return given.with_(frames=np.arange(len(rows)), video=video, **made)


def hole(given: Given, _: Bases) -> Given:
    """An hour is lost."""
    words = {name: value for name, value in given.words.items() if name != "fps"}
    return given.with_(points=None, time_s=given.frames / 30 + 3600.0 * (given.frames > 40), words=words)


# Joints in another's place.


@told_before
def permuted(points: np.ndarray, **of: str) -> np.ndarray:
    """joint=other: the joint's column holds the other one."""
    layout = layout_of(points)
    new = points.copy()
    new[:, layout.indices(list(of))] = points[:, layout.indices(list(of.values()))]
    return new


@told_before
def sides_of(points: np.ndarray, *parts: str, of_half: bool = False) -> np.ndarray:
    """Left and right of these joints, of all where none is named, exchanged in all rows or from the middle on."""
    named = parts or _sided(layout_of(points))
    both = {f"{a}_{each}": f"{b}_{each}" for each in named for a, b in ("lr", "rl")}
    start = len(points) // 2 if of_half else 0
    points[start:] = permuted(**both)(points[start:])
    return points


def sides_and_scores(given: Given, _: Bases) -> Given:
    """Left and right of all keypoints exchanged with their scores."""
    points, scores = (sides_of()(given.points[..., part].copy()) for part in (slice(2), [2, 2]))
    return given.with_(points=np.concatenate([points, scores[..., :1]], axis=-1), video=None)


def leg_copied(points: np.ndarray) -> np.ndarray:
    """The right leg is the left one, moved to its hip."""
    layout = layout_of(points)
    to, of = (layout.indices([f"{side}_{each}" for each in ("knee", "ankle")]) for side in "rl")
    hips = layout.indices(["r_hip", "l_hip"])
    points[:, to] = points[:, of] + (points[:, hips[:1]] - points[:, hips[1:]])
    return points


@told_before
def lost(
    points: np.ndarray, fill: Callable[[np.ndarray, int, int], np.ndarray], rows: int, apart: int
) -> np.ndarray:
    """Limbs are lost for some rows every so often; fill: of all points, the first row and the one behind the last ->
    (rows, 17, D) what stands there then."""
    limbs = layout_of(points).indices([f"{side}_{each}" for side in "lr" for each in LIMBS])
    old = points.copy()
    for first in range(5, len(points) - rows, apart):
        points[first : first + rows, limbs] = fill(old, first, first + rows)[:, limbs]
    return points


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


@told_before
def smooth(points: np.ndarray, frames: int, mode: str = "reflect") -> np.ndarray:
    return uniform_filter1d(points, frames, axis=0, mode=mode)


@told_before
def trailing(points: np.ndarray, share: float) -> np.ndarray:
    """Exponential smoothing, which lags."""
    for row in range(1, len(points)):
        points[row] = share * points[row - 1] + (1 - share) * points[row]
    return points


@told_before
def rotated(points: np.ndarray, degrees: float) -> np.ndarray:
    """In the image's plane, about the middle of all points."""
    sin, cos = np.sin(np.radians(degrees)), np.cos(np.radians(degrees))
    middle = points.mean(axis=(0, 1)) if points.shape[-1] == 2 else np.zeros(3)
    at = points - middle
    at[..., 0], at[..., 1] = cos * at[..., 0] - sin * at[..., 1], sin * at[..., 0] + cos * at[..., 1]
    return at + middle


@told_before
def resized(given: Given, x: float, y: float, size_too: bool = True, video: bool = False) -> Given:
    """Pixels so many times as wide and high, and the image's size with them."""
    size = tuple(int(side) for side in given.size * (x, y))
    words = given.words | {"image_size": size} if size_too else given.words
    return given.with_(points=given.points * (x, y, 1), words=words, video=given.video if video else None)


def turned(given: Given, _: Bases) -> Given:
    """The image lies on its side."""
    width, height = given.words["image_size"]
    x, y, score = np.moveaxis(given.points, -1, 0)
    points = np.stack([height - y, x, score], axis=-1)
    return given.with_(points=points, words=given.words | {"image_size": (height, width)}, video=None)


def moved(x: float, y: float) -> Make:
    """By so many shares of the image, as of keypoints of a crop beside the whole video."""
    return in_image(lambda points, size: points + size * (x, y), video=True)


@told_before
def half_in_another_unit(points: np.ndarray, factor: float) -> np.ndarray:
    """From the middle on."""
    points[len(points) // 2 :] *= factor
    return points


@told_before
def less(joints: np.ndarray, share: float) -> np.ndarray:
    """The movement about the mean pose so many times as large."""
    return joints.mean(axis=0) + share * (joints - joints.mean(axis=0))


@told_before
def legs(joints: np.ndarray, factor: float) -> np.ndarray:
    """Legs so many times as long."""
    for side in "lr":
        hip, *below = H36M17.indices([f"{side}_{each}" for each in ("hip", "knee", "ankle")])
        joints[:, below] = joints[:, [hip]] + factor * (joints[:, below] - joints[:, [hip]])
    return joints


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
    points = np.resize(np.asarray(bases["08_04"].points), given.points.shape)
    scale = np.ptp(given.points[..., 1]) / max(np.ptp(points[..., 1]), 1.0)
    about, to = points[..., :2].mean(axis=(0, 1)), given.points[..., :2].mean(axis=(0, 1))
    points[..., :2] = (points[..., :2] - about) * scale + to
    return given.with_(points=points)


def of_other_in_place(given: Given, bases: Bases) -> Given:
    """Keypoints of another recording, made to fill the same part of the image in every row."""
    other = np.resize(np.asarray(bases["07_03"].points), given.points.shape)

    def ends(of: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return of[..., :2].min(axis=1, keepdims=True), of[..., :2].max(axis=1, keepdims=True)

    points, (low, high), (their_low, their_high) = given.points.copy(), ends(given.points), ends(other)
    size = (high - low)[..., 1:] / (their_high - their_low)[..., 1:]
    points[..., :2] = (low + high) / 2 + size * (other[..., :2] - (their_low + their_high) / 2)
    return given.with_(points=points)


def arm_of_other(given: Given, bases: Bases) -> Given:
    """The right arm is another recording's, hung on this shoulder."""
    points, arm = given.points.copy(), COCO17.indices(["r_elbow", "r_wrist"])
    shoulder = COCO17.index("r_shoulder")
    their = np.resize(np.asarray(bases["accad-m1_lift-box"].points), points.shape)
    size = np.ptp(points[..., 1]) / np.ptp(their[..., 1])
    points[:, arm, :2] = points[:, [shoulder], :2] + size * (their[:, arm, :2] - their[:, [shoulder], :2])
    return given.with_(points=points, video=None)
