"""What users do to their files by accident, and the codes of which one has to tell it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from . import changes as to
from .changes import Make, every, in_image, kept, of_points, of_poses, permuted, resized, sides_of

CLOCK = ("rate-against-movement", "rows-lost", "rows-added", "fps-contradicts", "gait-unlike-any-seen")
TOGETHER = ("keypoints-not-of-poses", "keypoints-not-of-video")
SHAPE = (
    "depth-scaled", "bones", "flat", "stature", "limbs-copied", "left-and-right", "mirrored", "legs-against-arms",
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
    make: Make
    codes: tuple[str, ...] = ()
    part: str = "first"

    def __str__(self) -> str:
        return f"{self.base}: {self.name}"


def edits() -> Iterator[Edit]:
    """All of them."""
    for bases, table in FIRST:
        for base in bases:
            for name, (make, codes) in table.items():
                yield Edit(base, name, make, codes)
    for name, (bases, make, codes) in (LATER | LAST).items():
        part = "last" if name in LAST else "chosen by" if name in CHOSEN_BY else "looked at once"
        for base in bases:
            yield Edit(base, name, make, codes, part)


def _mirrored(points: np.ndarray, size: np.ndarray) -> np.ndarray:
    return points * (-1, 1) + (size[0], 0)


def _depth(share: float, alone: bool = True) -> Make:
    return of_poses(lambda joints: joints * (1, 1, share), alone)


def _swapped(one: str, other: str) -> to.Change:
    """In each other's column."""
    return permuted(**{one: other, other: one})


LIFTED: dict[str, tuple[Make, tuple[str, ...]]] = {
    "60 frames a second told of 30": (to.told_rate(60.0), CLOCK),
    "15 told of 30": (to.told_rate(15.0), CLOCK),
    "every second frame kept, numbers lost": (every(2, 1), CLOCK),
    "every fifth frame dropped, numbers lost": (every(5, 4), CLOCK),
    "ten in a row dropped, numbers lost": (
        kept(lambda count: np.delete(np.arange(count), slice(30, 40))), (*CLOCK, *PEOPLE)),
    "in a loop, three times": (kept(lambda count: np.tile(np.arange(count), 3)), ("repeats-itself", *PEOPLE)),
    "backwards": (kept(lambda count: np.arange(count)[::-1]), CLOCK),
    "shuffled": (
        kept(lambda count: np.random.default_rng(0).permutation(count)), (*PEOPLE, *CLOCK, *SHAPE, "only-noise")),
    "mirrored": (in_image(_mirrored), SIDES),
    "left and right exchanged": (to.sides_and_scores, SIDES),
    "image 1.33 times as wide": (resized(1.33, 1.0), SHAPE),
    "image 1.33 times as high": (resized(1.0, 1.33), SHAPE),
    "on its side": (to.turned, UP),
    "upside down": (in_image(lambda xy, size: size - xy), UP),
    "two people of one ID": (in_image(to.two_people), (*PEOPLE, *SHAPE)),
    "smoothed over 31 frames": (of_points(to.smooth(31, "nearest")), (*SHAPE, "keypoints-smooth")),
    "right leg a copy of the left": (of_points(to.leg_copied), SHAPE),
    "shares of the image as pixels": (in_image(lambda xy, size: xy / size), (*SHAPE, *TOGETHER)),
    "focal length told 2.2 times too long": (to.focal_times(2.2), ("focal-contradicted",)),
    "height told in centimetres": (to.told(stature=175.0), ("stature",)),
    "ankles exchanged": (of_points(sides_of("ankle")), (*GAPS, *SIDES)),
    "knees exchanged": (of_points(sides_of("knee")), (*GAPS, *SIDES)),
    "wrists exchanged": (of_points(sides_of("wrist")), (*GAPS, *SIDES)),
    "gaps of 15 frames filled by lines": (of_points(to.lost(to.by_lines, 15, 35)), GAPS),
    "gaps of 15 frames filled by the last value": (of_points(to.lost(to.by_last, 15, 35)), GAPS),
    "right wrist at the nose": (of_points(permuted(r_wrist="nose")), GAPS),
    "left knee at the left hip": (of_points(permuted(l_knee="l_hip")), GAPS),
    "second half a copy of the first": (
        kept(lambda count: np.tile(np.arange(count // 2), 2)), ("repeats-itself", *PEOPLE)),
    "rows put between by lines, told of 30": (to.at_rate(2.0), (*GAPS, *CLOCK)),
    "made into 50 frames a second by lines, told of 30": (to.at_rate(50 / 30), (*GAPS, *CLOCK, *TOGETHER)),
    "18 frames a second told of 30": (to.told_rate(18.0), CLOCK),
    "trimmed": (kept(lambda count: np.arange(10, count - 3)), ()),
    "half of the pixels": (resized(0.5, 0.5), ()),
}  # fmt: skip
POSES: dict[str, tuple[Make, tuple[str, ...]]] = {
    "depth of 30 %": (_depth(0.3, alone=False), (*SHAPE, *TOGETHER)),
    "depth of 60 %": (_depth(0.6), SHAPE),
    "depth of 200 %": (_depth(2.0), SHAPE),
    "half of the movement": (of_poses(to.less(0.5), alone=False), (*SHAPE, *TOGETHER)),
    "a tenth of the movement": (of_poses(to.less(0.1), alone=False), (*SHAPE, *TOGETHER)),
    "half of the movement, alone": (of_poses(to.less(0.5)), SHAPE),
    "smoothed over 15 frames": (of_poses(to.smooth(15, "nearest")), SHAPE),
    "smoothed over 31 frames": (of_poses(to.smooth(31, "nearest")), SHAPE),
    "right leg a copy of the left": (of_poses(to.leg_copied), SHAPE),
    "mirrored": (of_poses(lambda joints: joints * (-1, 1, 1)), SIDES),
    "depth turned over": (_depth(-1), SIDES),
    "up turned over": (of_poses(lambda joints: joints * (1, -1, 1)), (*UP, *SIDES)),
    "left and right exchanged": (of_poses(sides_of()), SIDES),
    "one pose and 3 mm of noise": (
        of_poses(lambda joints: joints[:1] + np.random.default_rng(0).normal(0, 0.003, joints.shape)),
        ("only-noise",)),
    "metres told as millimetres": (lambda given, _: given.with_(unit="mm", points=None), ("stature", *SHAPE)),
    "z up told as a camera's": (
        of_poses(lambda joints: np.stack([joints[..., 0], joints[..., 2], -joints[..., 1]], -1)), (*UP, *SIDES)),
    "a hole of an hour": (to.hole, ("images-lacking",)),
    "2 rows late": (to.late(2), TOGETHER),
    "5 rows late": (to.late(5), TOGETHER),
    "60 frames a second told of 30": (to.told_rate(60.0), CLOCK),
    "made at 25 frames a second, keypoints of 30": (to.at_rate(25 / 30, points=False, poses=True), TOGETHER),
    "beside keypoints of 25 frames a second": (to.at_rate(25 / 30), TOGETHER),
    "ankles exchanged": (of_poses(sides_of("ankle")), (*GAPS, *SIDES)),
    "knees exchanged": (of_poses(sides_of("knee")), (*GAPS, *SIDES)),
    "gaps of 15 frames filled by lines": (of_poses(to.lost(to.by_lines, 15, 35)), GAPS),
    "right wrist at the nose": (of_poses(permuted(r_wrist="nose")), GAPS),
    "second half a copy of the first": LIFTED["second half a copy of the first"],
    "in a loop, three times": (
        lambda given, bases: LIFTED["in a loop, three times"][0](given.with_(points=None), bases),
        ("repeats-itself", *PEOPLE)),
}  # fmt: skip
FILMED: dict[str, tuple[Make, tuple[str, ...]]] = {
    "keypoints of another recording": (to.of_other, TOGETHER),
    "keypoints of the mirrored video": (in_image(_mirrored, video=True), (*TOGETHER, *SIDES)),
    "keypoints of the video backwards": (to.shown(lambda rows: rows[::-1], video=True), TOGETHER),
    "keypoints of the video slowed by 4": (
        to.shown(lambda rows: rows // 4, video=True), (*TOGETHER, *CLOCK)),
    "keypoints of the video slowed by 2": (
        to.shown(lambda rows: rows // 2, video=True), (*TOGETHER, *CLOCK)),
    "keypoints made at 25 frames a second": (to.at_rate(25 / 30), TOGETHER),
    "keypoints made at 24 frames a second": (to.at_rate(24 / 30), TOGETHER),
    "keypoints 2 rows late": (to.late(2), TOGETHER),
    "keypoints 3 rows late": (to.late(3), TOGETHER),
    "keypoints 5 rows early": (to.late(-5), TOGETHER),
    "keypoints of a part, numbered from 0": (to.part(0.3, 0.8), TOGETHER),
}  # fmt: skip
FIRST = (
    (
        (
            "walker",
            "walk_crop",
            "07_03",
            "08_04",
            "accad-m1_run",
            "accad-m1_lift-box",
            "tennis-jangel_Derecha_0",
        ),
        LIFTED,
    ),
    (("walker poses", "walk_crop poses", "07_03 poses", "accad-m1_lift-box poses"), POSES),
    (("walker", "walk_crop"), FILMED),
)

# Sixty more, each of two recordings. Of the first forty rules were chosen by every second one, and the others looked
# at; the last twenty were written after all rules, and looked at once. A few more codes tell these.
_CLOCK = (*CLOCK, "duplicates")
_SHAPE = (*SHAPE, "joints-exchanged", "joints-filled", "joints-coincide")
_SIDES = (*SIDES, "joints-exchanged")
_SWAPS = ("swaps-found", "swaps-doubtful", *_SIDES)
_UP = (*UP, "on-its-side", "image-against-bodies")
_GAPS = (*GAPS, "images-lacking", "gaps")
_FILMS, _WALKS = ("walker", "walk_crop"), ("07_03", "walk_crop")
_POSES = ("07_03 poses", "accad-m1_lift-box poses")
_RUN, _BOX, _TENNIS = "accad-m1_run", "accad-m1_lift-box", "tennis-jangel_Derecha_0"

LATER: dict[str, tuple[tuple[str, ...], Make, tuple[str, ...]]] = {
    "every third frame dropped, numbers lost": (("07_03", _RUN), every(3, 2), _CLOCK),
    "every row twice": (
        ("07_03", "08_04"), kept(lambda count: np.repeat(np.arange(count), 2)), (*_CLOCK, *_GAPS)),
    "found in every third frame, and held": (
        ("08_04", _RUN), to.shown(lambda rows: rows // 3 * 3), (*_CLOCK, *_GAPS)),
    "second half the last row again": (
        ("07_03", _TENNIS), to.shown(lambda rows: np.minimum(rows, len(rows) // 2)), (*_CLOCK, *_GAPS)),
    "left side 4 rows late": (("07_03", _RUN), of_points(to.joints_late(4, sides="l")), (*_SHAPE, *_SWAPS)),
    "right knee and ankle in each other's column": (
        ("08_04", _BOX), of_points(_swapped("r_knee", "r_ankle")), (*_SHAPE, *_SIDES)),
    "left elbow and wrist in each other's column": (
        ("07_03", _RUN), of_points(_swapped("l_elbow", "l_wrist")), (*_SHAPE, *_SIDES)),
    "legs' sides exchanged": (("07_03", _BOX), of_points(sides_of("hip", "knee", "ankle")), _SIDES),
    "arms' sides exchanged": (("08_04", _TENNIS), of_points(sides_of("shoulder", "elbow", "wrist")), _SIDES),
    "legs' sides exchanged from the middle on": (
        ("07_03", _RUN), of_points(sides_of("hip", "knee", "ankle", of_half=True)), _SWAPS),
    "hips exchanged": (("07_03", _BOX), of_points(sides_of("hip")), _SIDES),
    "ears and shoulders exchanged": (
        ("08_04", "walk_crop"),
        of_points(permuted(l_ear="l_shoulder", l_shoulder="l_ear", r_ear="r_shoulder", r_shoulder="r_ear")), _SHAPE),
    "y upwards": (
        ("08_04", "walk_crop"), in_image(lambda xy, size: xy * (1, -1) + (0, size[1])), (*_UP, *_SIDES)),
    "width squeezed to 0.6": (("07_03", _BOX), resized(0.6, 1.0), _SHAPE),
    "height squeezed to 0.5625": (("08_04", "walk_crop"), resized(1.0, 0.5625), _SHAPE),
    "rounded to 16 pixels": (
        ("07_03", _RUN), of_points(lambda xy: 16 * np.round(xy / 16)), (*_SHAPE, "only-noise")),
    "smoothed over 11 frames": (("08_04", _RUN), of_points(to.smooth(11)), (*_SHAPE, "keypoints-smooth")),
    "exponentially smoothed": (("07_03", _RUN), of_points(to.trailing(0.85)), (*_SHAPE, "keypoints-smooth")),
    "somebody else every 20 rows": (("07_03", _BOX), in_image(to.alternating), PEOPLE),
    "right arm of another recording": (("07_03", "08_04"), to.arm_of_other, (*_SHAPE, *TOGETHER)),
    "second half in half the pixels": (
        ("07_03", _BOX), of_points(to.half_in_another_unit(0.5)), (*PEOPLE, *_SHAPE)),
    "lost joints put at the image's corner": (
        ("08_04", _BOX), of_points(to.lost(lambda xy, first, end: np.zeros_like(xy[first:end]), 6, 20)), _GAPS),
    "lost joints put at the body's middle": (
        ("07_03", _RUN), of_points(to.lost(to.by_middle, 6, 20)), _GAPS),
    "rolled by 35 degrees": (("07_03", "08_04"), of_points(to.rotated(35.0)), _UP),
    "centimetres from the middle on": (_POSES, of_poses(to.half_in_another_unit(100.0)), (*PEOPLE, *_SHAPE)),
    "left leg's x negated": (_POSES, of_poses(to.left_leg_negated), (*_SHAPE, *_SIDES)),
    "x and depth exchanged": (_POSES, of_poses(lambda joints: joints[..., [2, 1, 0]]), (*_SIDES, *_SHAPE)),
    "hands and feet without depth": (_POSES, of_poses(to.depth_lost), _SHAPE),
    "legs 1.35 times as long": (_POSES, of_poses(to.legs(1.35), alone=False), (*_SHAPE, *TOGETHER)),
    "each row turned to the camera": (_POSES, of_poses(to.facing, alone=False), TOGETHER),
    "rolled by 40 degrees, keypoints not": (_POSES, of_poses(to.rotated(40.0), alone=False), TOGETHER),
    "rounded to 5 cm": (_POSES, of_poses(lambda joints: 0.1 * np.round(joints / 0.1)), _SHAPE),
    "poses of 50 frames a second beside keypoints of 30": (
        _POSES, to.at_rate(50 / 30, points=False, poses=True), TOGETHER),
    "keypoints of a crop": (_FILMS, to.moved(-0.12, -0.1), TOGETHER),
    "keypoints lack one row in 16": (_FILMS, every(16, 15, video=True), (*TOGETHER, *_CLOCK)),
    "keypoints lack 12 rows in the middle": (
        _FILMS, kept(lambda count: np.delete(np.arange(count), slice(int(0.45 * count), int(0.45 * count) + 12)), True),
        (*TOGETHER, *_CLOCK, *PEOPLE)),
    "keypoints made at 50 frames a second": (_FILMS, to.at_rate(50 / 30, noise_px=0.3), TOGETHER),
    "keypoints of another recording, in the same place": (_FILMS, to.of_other_in_place, TOGETHER),
    "keypoints of half the video's size": (_FILMS, resized(0.5, 0.5, size_too=False, video=True), TOGETHER),
    "focal length told 0.4 times": (_FILMS, to.focal_times(0.4), ("focal-contradicted", "image-against-bodies")),
}  # fmt: skip
CHOSEN_BY = list(LATER)[::2]
LAST: dict[str, tuple[tuple[str, ...], Make, tuple[str, ...]]] = {
    "every fourth frame dropped, numbers lost": (("08_04", _RUN), every(4, 3), _CLOCK),
    "20 frames a second told of 30": (_WALKS, to.told_rate(20.0), _CLOCK),
    "50 frames a second told of 30": (("08_04", _RUN), to.told_rate(50.0), _CLOCK),
    "at half its rate and backwards": (
        ("07_03", _RUN), lambda given, bases: to.told_rate(15.0)(LIFTED["backwards"][0](given, bases), bases), _CLOCK),
    "width stretched to 1.5": (("07_03", _TENNIS), resized(1.5, 1.0), _SHAPE),
    "height squeezed to 0.8": (("08_04", _RUN), resized(1.0, 0.8), _SHAPE),
    "elbows exchanged": (("07_03", _BOX), of_points(sides_of("elbow")), _SIDES),
    "shoulders exchanged": (("08_04", _TENNIS), of_points(sides_of("shoulder")), _SIDES),
    "right ankle and wrist in each other's column": (
        ("08_04", _RUN), of_points(_swapped("r_ankle", "r_wrist")), (*_SHAPE, *_SIDES)),
    "legs 10 rows late": (("07_03", _BOX), of_points(to.joints_late(10, "knee", "ankle")), _SHAPE),
    "every second row held": (("07_03", _TENNIS), to.shown(lambda rows: rows // 2 * 2), (*_CLOCK, *_GAPS)),
    "smoothed over 21 frames": (("07_03", _BOX), of_points(to.smooth(21)), (*_SHAPE, "keypoints-smooth")),
    "cut off at six tenths of the width": (
        ("08_04", _TENNIS), in_image(lambda xy, size: np.minimum(xy, (0.6 * size[0], np.inf))),
        (*_GAPS, *_SHAPE, "not-seen")),
    "poses smoothed over 21 frames": (_POSES, of_poses(to.smooth(21)), _SHAPE),
    "poses with every third row held": (_POSES, to.shown(lambda rows: rows // 3 * 3), (*_CLOCK, *_GAPS)),
    "poses with arms' sides exchanged": (_POSES, of_poses(sides_of("shoulder", "elbow", "wrist")), _SIDES),
    "poses with the left knee and ankle in each other's column": (
        _POSES, of_poses(_swapped("l_knee", "l_ankle")), (*_SHAPE, *_SIDES)),
    "poses of half the depth": (_POSES, _depth(0.5), _SHAPE),
    "keypoints lack one row in 10": (_FILMS, every(10, 9, video=True), (*TOGETHER, *_CLOCK)),
    "keypoints shifted by a tenth of the width": (_FILMS, to.moved(0.1, 0.0), TOGETHER),
}  # fmt: skip
