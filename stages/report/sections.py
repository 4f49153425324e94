"""What a report says in words and tables: whom it is about, how up was found, and where everything comes from."""

from __future__ import annotations

from collections.abc import Sequence
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from ...pipeline.core.messages import bound_in_words, how_many, rate_in_words
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import REPORT, SUMMARY
from ..drawing.facts import Facts
from ..drawing.page import Cell, Link, box, bullets, details, small, table
from ..drawing.provenance import provenance

_MOST = 40  # notices of one kind
_HEADINGS = {
    "camera": "Front is towards the camera, and right is the camera's left.",
    "world": "Front and right are those of the file's world.",
}
_FILES = {
    "measures.csv": "figures of movements and ranges of motion, for Excel or another spreadsheet",
    "strides.csv": "strides and repetitions from 0 to 100 %: all angles with errors, and events",
    "kinematics.csv": "angles, paths, speeds and accelerations of every frame, for Excel or another spreadsheet",
    "kinematics.parquet": "angles, paths, speeds and accelerations of every frame, for Python, R or MATLAB",
    "poses.npz": "joints of every frame before and after, for Python",
    "take.rrd": "the recording; pcnet3d view FOLDER plays it",
    "keypoints.npz": "the 2D keypoints that were found in the video",
}


def session_words(take: Take, facts: Facts) -> Markup:
    """Whom and what the page is about, under its title: person and date, if given, the take's name and its length."""
    poses, several = take.need("poses"), len(take.need("poses")) > 1
    parts = [
        f"Person {take.session.person_id}" if take.session.person_id else "",
        take.session.date,
        take.name if take.name != take.title else "",
        _frames(take) + f", {poses.duration_s:.1f} s{rate_in_words(poses.fps, ' at ')}" * several,
        f"camera {facts.camera_motion}" if facts.camera_motion and several else "",
    ]
    return small(" · ".join(part for part in parts if part))


def _frames(take: Take) -> str:
    """How many frames the page is about; if the person was followed only in a part of the video, of how many."""
    poses, video = take.need("poses"), take.video
    if video is None or len(poses) >= (looked_at := video.span[1] + 1 - video.span[0]):
        return how_many(len(poses), "frame")
    part, (first_s, last_s) = "this part of " * (looked_at < len(video.time_s)), poses.times[[0, -1]]
    whom = f"person {poses.person}, from {first_s:.1f} to {last_s:.1f} s"
    return f"{len(poses)} of the {looked_at} frames of {part}the video ({whom})"


def files_beside(names: Sequence[str]) -> Markup:
    """A table of the files of a run with what they hold, each name a link. names: of those in the page's folder."""
    rows: list[list[Cell]] = [
        [Link(name, quote(name)), _FILES.get(name)]
        for name in sorted(names, key=lambda name: [*_FILES, name].index(name))
        if name not in (REPORT, SUMMARY) and not name.startswith(".")
    ]
    return table(("file", "what it holds"), rows)


def repairs_of(take: Take) -> Markup:
    """What was repaired, on demand."""
    repairs = take.texts("repair")
    return details(f"{how_many(len(repairs), 'repair')} made", bullets(_most(repairs)))


def gravity_words(facts: Facts) -> Markup:
    """How the camera stands and what up rests on."""
    if facts.up_of_world:
        return small(facts.up_words)
    relative = "; front and right are relative to it" if facts.rectified.camera == "moving" else ""
    error = facts.error_deg
    faces = f"The direction that the body faces is off by less than {bound_in_words(error)}° in half of the frames."
    lines = [
        f"The camera {facts.camera_words}{relative}.",
        f"Up: {facts.up_words} {facts.rests_words}".rstrip(),
        _HEADINGS.get(facts.rectified.level_heading, "Front and right are the person's own."),
        *([faces] if np.isfinite(error) and not facts.up_of_unusable else []),
    ]
    return bullets(lines)


def provenance_of(take: Take) -> Markup:
    """Inputs, how they were read and versions, as in every file of the run; then the notes."""
    poses = take.need("poses")
    lines = {
        "poses": f"person {poses.person}, frames {poses.frame_index[0]} to {poses.frame_index[-1]}, {poses.frame}",
        "rectified": f"{take.need('rectified').turned.sum()} of {how_many(len(poses), 'frame')}",
    }
    if (video := take.video) is not None:
        turned = f", turned by {video.rotation_deg}°" if video.rotation_deg else ""
        lines["video"] = (
            f"{video.width} x {video.height} pixels, {how_many(len(video.time_s), 'frame')}"
            f"{rate_in_words(video.fps, ' at ')}, {video.codec}{turned}"
        )
    shown = {name: text for name, text in provenance(take).items() if not name.startswith("warning")}
    return table(("", ""), [*(shown | lines).items()]) + box("Notes", _most(take.texts("note")))


def _most(texts: Sequence[str]) -> list[str]:
    more = len(texts) - _MOST
    return [*texts[:_MOST], f"and {more} more, in summary.json"] if more > 0 else list(texts)
