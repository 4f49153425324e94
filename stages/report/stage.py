"""The report: report.html, one page about a take to look at, print and hand on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
from markupsafe import Markup

from ...pipeline.core.answer import JointRange, joint_ranges
from ...pipeline.core.answer import answer as seen
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import Group, Measure, grouped, subgroup
from ...pipeline.core.pose import PoseSequence
from ...pipeline.core.rotations import is_finite
from ...pipeline.core.system import give_memory_back
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import REPORT, write_text
from ...pipeline.files.video_frames import images_at
from ...pipeline.inspect.image import from_the_front
from ..drawing.charts import LEFT, RIGHT, SOFT, Curve, over_time, path
from ..drawing.facts import Facts, facts_of, length_unit, tilt, voted, ways_of_level
from ..drawing.image_lines import WORDS, drawn
from ..drawing.page import answer, beside, charts, details, figure, page, picture, small, table
from .angles import angle_charts, ranges, sides_compared
from .key_frames import key_figures, lines_jpeg
from .measures import happened, measure_tables
from .motion import motion_charts
from .player import skeleton_player
from .sections import files_beside, gravity_words, provenance, session_words, told_of, up_table
from .trust import trust

_ERRORS = 'On this page ±, "within" and 90 % mean the same: nine in ten true values lie in that range.'
_PATHS = "The errors of these lengths are not known."


@dataclass(frozen=True)
class Report:
    """The stage. folder: where report.html goes."""

    folder: Path

    name: ClassVar[str] = "report"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified")
    gives: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[tuple[str, ...]] = ("images",)

    def __call__(self, take: Take) -> Take:
        self.folder.mkdir(parents=True, exist_ok=True)
        files = [path.name for path in self.folder.iterdir() if path.is_file()]
        write_text(self.folder / REPORT, report(take, files))
        return take


def report(take: Take, files: Sequence[str] = ()) -> str:
    """A take as one HTML page that holds its images, loads nothing, and runs no script but our own for reading off its
    charts.

    On the first screen what was seen, the video beside the upright skeleton, and how far to trust it; folded, key
    frames, the movements that happened, angles and paths, and where everything comes from. What the take lacks (video,
    angles, measures, ...) is left out; so are the video's images where `take.told.images` is False. files: names of the
    files in the page's folder, to lead to. Raises InputError without poses, rectified poses or time stamps, or when the
    video cannot be decoded.
    """
    if take.poses is None or take.rectified is None:
        raise InputError("needs-stage", "A report needs 3D poses and their rectification; run rectify first.")
    facts, measures = facts_of(take), grouped(take.measures or ())
    give_memory_back()
    said = [*seen(take, with_ranges=False), *sides_compared(measures)]
    joints = joint_ranges(subgroup(measures, "range_of_motion"))
    withheld = [each.text for each in take.notices if each.code == "figures-withheld"]
    stated = any(isinstance(row, Measure) and row.error is not None for row in take.measures or ())
    head = session_words(take, facts) + answer(said or withheld) + skeleton_player(take)
    head += trust(take, facts) + told_of(take) + _furthest(joints)
    head += small(_ERRORS) if stated else Markup("")
    several = len(take.poses) > 1  # charts over time of one frame are empty
    sections = [
        ("Key frames", _key_frames(take)),
        ("Ranges of motion", ranges(measures, take.angle_errors)),
        ("What happened", happened(take.measures or (), length_unit(take.poses))),
        (
            "Joint angles over time" if several else "Joint angles",
            angle_charts(take) + _off_keypoints(measures, length_unit(take.poses)),
        ),
        ("Speeds and accelerations", _motion(take, measures) if several else Markup("")),
        ("Wrist paths before and after", _wrists(take) if several else Markup("")),
        ("Which way is up", _gravity(take, facts)),
        ("Files beside this page", files_beside(files)),
        ("Where this comes from", provenance(facts, take)),
    ]
    return page(take.title, head, sections, folded=True)


def _furthest(joints: Sequence[JointRange]) -> Markup:
    """The joints that range furthest; those with a right and a left side, and those of the trunk."""

    def rows(sides: tuple[str, ...]) -> list[tuple[str | None, ...]]:
        return [
            (
                of.joint,
                *(of.sides.get(side, "–").replace(" to ", "\u00a0to\u00a0") for side in sides),
                "not known" if of.bar is None else f"{of.bar:.0f}",
            )
            for of in joints
            if not of.sides.keys().isdisjoint(sides)
        ]

    head, within = "In nine of ten frames, degrees", "± of each end"
    of_limbs = table((head, "right", "left", within), rows(("right", "left")))
    return beside(of_limbs, table((head, "", within), rows(("",))))


def _motion(take: Take, measures: Group) -> Markup:
    length = length_unit(take.need("poses"))
    paths: Group = {name: path for name, path in subgroup(measures, "paths").items() if name != "withheld"}
    lengths = small(_PATHS) + measure_tables(paths, length, level=3) if paths else Markup("")
    return motion_charts(take) + details("Lengths of the paths", lengths)


def _off_keypoints(measures: Group, length: str) -> Markup:
    limbs: Group = {
        name: limb for name, limb in subgroup(measures, "off_keypoints").items() if isinstance(limb, dict)
    }
    words = small(
        "Distance of the projected bones from those of the keypoints, in pixels and in per cent of the body's height "
        "in the image. Start and stop: when a limb contradicts its keypoints; the errors of its angles are larger "
        "then."
    )
    shown = words + measure_tables(limbs, length, level=3) if limbs else Markup("")
    return details("Limbs against their keypoints", shown)


def _key_frames(take: Take) -> Markup:
    figures = key_figures(take)
    upright = "upright" if take.need("rectified").level_ok else "as it came, not levelled"
    chosen = "Moments of events and, between them, frames chosen for their posture. "
    words = chosen * (len(take.need("poses")) > 1) + (
        f"Beside each image the same pose is {upright}, seen from the front and from its right side. "
        "Orange is the person's right, blue the left."
    )
    return small(words) + charts(figures) if figures else Markup("")


def _wrists(take: Take) -> Markup:
    rectified = take.need("rectified")
    camera = "those of the camera in each frame" if rectified.camera == "moving" else "the camera's"
    heading = {
        "camera": f"{camera}: back is away from it, right to its left",
        "world": "the world's: back is its north, right its west",
    }.get(rectified.level_heading, "the same for the whole take")
    return small(
        "Relative to the pelvis, unfiltered. Before: in the source's axes. After: turned upright; directions on "
        f"the floor are {heading}. Orange: right. Blue: left. The cross is the pelvis."
    ) + charts(_ways(take))


def _ways(take: Take) -> Iterator[Markup]:
    """Both wrists' paths as lines: as the camera or one who looks north sees them, and in LEVEL; all at one scale."""
    source, rectified = take.need("poses"), take.need("rectified")
    before, level = (_from_pelvis(poses, "r_wrist", "l_wrist") for poses in (source, rectified.level))
    seen, words = "camera's view", "right and up are those of the image"
    if source.frame.family != "camera":
        seen, words = "looking north", "the world's east is to the right"
    front, right = ways_of_level(rectified.level_heading)
    views = {
        f"Before: {seen}": (from_the_front(before, source.frame) * (1, -1), words),
        f"After: from {right}": (level[..., [0, 2]] * (-1, 1), f"{front} is to the right"),
        "After: from above": (level[..., [1, 0]] * (1, -1), f"{front} is up, {right} to the right"),
    }
    boxes = {name: _box(points) for name, (points, _) in views.items()}
    reach = max(reach for _, reach in boxes.values())
    for name, (points, words) in views.items():
        title = f"{name} ({length_unit(source)})"
        both = dict(zip((RIGHT, LEFT), points.swapaxes(0, 1), strict=True))
        yield figure(
            [path(both, boxes[name][0], reach, f"Paths of both wrists: {title}")],
            title,
            f"{words[0].upper()}{words[1:]}.",
        )


def _from_pelvis(poses: PoseSequence, *joints: str) -> np.ndarray:
    """(T, len(joints), 3) of these joints."""
    places = poses.joints[:, poses.layout.indices(joints)].astype(np.float64)
    return places - poses.joint("pelvis")[:, None]


def _box(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (2,) of the square around points (..., 2), and half its side and a little more."""
    points = points[is_finite(points)]
    if not len(points):
        return np.zeros(2), 1e-3
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, max(0.55 * float((high - low).max()), 1e-3)


def _gravity(take: Take, facts: Facts) -> Markup:
    poses, rectified = take.need("poses"), take.need("rectified")
    figures = []
    if voted(rectified) and len(poses) > 1:
        votes, shared, bound = tilt(take)
        for i, (name, words) in enumerate(
            (
                ("Camera's pitch (°)", "positive looks down"),
                ("Camera's roll (°)", "positive turns the image's content counter-clockwise"),
            )
        ):
            curves = [
                Curve("each frame", votes[:, i], SOFT, width=0.8),
                Curve("take", shared[:, i], LEFT, bound[:, i], width=1.8),
            ]
            chart = over_time(curves, poses.times, f"{name} over time")
            band = "; band: 90 % bound" if np.isfinite(bound).any() else ""
            figures.append(figure([chart], name, f"{words}{band}."))
    return gravity_words(facts) + up_table(facts, take.camera is not None) + charts([*_lines(take), *figures])


def _lines(take: Take) -> Iterator[Markup]:
    """The frame whose straight lines were looked at, with them and the horizon."""
    if take.camera is None or not take.camera.looks or take.video is None or not take.told.images:
        return
    look = take.camera.looks[0]
    for image in images_at(take.video, [look.frame]).values():
        shown = picture(
            lines_jpeg(drawn(image, take.camera, look)), "jpeg", f"Straight lines of frame {look.frame}"
        )
        yield figure([shown], f"The image's lines, frame {look.frame}", WORDS)
