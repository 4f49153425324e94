"""What a report says in words and tables: whom it is about, how up was found, and where everything comes from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

import numpy as np
from markupsafe import Markup

from ...models.common.metrics import RAYLEIGH_90
from ...pipeline.core.messages import bound_in_words, how_many, rate_in_words
from ...pipeline.core.pose import package_version
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import REPORT, SUMMARY
from ..drawing.facts import SOURCES, Facts
from ..drawing.page import Cell, Link, box, bullets, details, small, table

_MOST = 40  # notices of one kind
_UNITS = {"m": "metres", "arbitrary": "units of the source"}
_HEADINGS = {
    "camera": "Front is towards the camera, and right is the camera's left.",
    "world": "Front and right are those of the file's world.",
}
_FILES = {
    "measures.csv": "what figures there are of movements and ranges of motion, for Excel or another spreadsheet",
    "strides.csv": "what strides and repetitions there are: all angles with errors at each per cent, and events",
    "kinematics.csv": "angles, paths, speeds and accelerations of every frame, for Excel or another spreadsheet",
    "kinematics.parquet": "angles, paths, speeds and accelerations of every frame, for Python, R or MATLAB",
    "poses.npz": "joints of every frame before and after, for Python",
    "take.rrd": "the recording, to be played by: pcnet3d view FOLDER",
    "keypoints.npz": "the 2D keypoints that were found in the video",
}
_LONGEST = 240  # characters of an option's value


def session_words(take: Take, facts: Facts) -> Markup:
    """Whom and what the page is about, under its title: person and date, if told, the recording and its length."""
    told = [
        f"Person {take.session.person_id}" if take.session.person_id else "",
        take.session.date,
        take.name if take.name != take.title else "",
        _frames(take, facts)
        + f", {facts.duration_s:.1f} s{rate_in_words(facts.poses.fps, ' at ')}" * (len(facts.poses) > 1),
        f"camera {facts.camera_motion}" if facts.camera_motion and len(facts.poses) > 1 else "",
    ]
    return small(" · ".join(words for words in told if words))


def _frames(take: Take, facts: Facts) -> str:
    """How many frames the page is about, and of how many where the person was followed in a part of the video alone."""
    own, video = len(facts.poses), take.video
    if video is None or own >= (looked_at := video.span[1] + 1 - video.span[0]):
        return how_many(own, "frame")
    part, (first_s, last_s) = "this part of " * (looked_at < len(video.time_s)), facts.poses.times[[0, -1]]
    whom = f"person {facts.poses.person}, from {first_s:.1f} to {last_s:.1f} s"
    return f"{own} of the {looked_at} frames of {part}the video ({whom})"


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
    repairs = [each.text for each in take.notices if each.weight == "repair"]
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


def up_table(facts: Facts, image: bool) -> Markup:
    """What each source says about the camera alone, with its 90 % bound, and how far it pulls the take's up; nothing of
    one source only, unless the image was looked at."""
    rows: list[list[str | float | None]] = []
    for name, source in facts.sources.items():
        error_deg = None if facts.up_of_unusable else source.error_deg
        bound = None if error_deg is None else RAYLEIGH_90 * error_deg
        own = [_rounded(angle, bound) for angle in (source.pitch_deg, source.roll_deg)]
        share = "not used" if source.share is None else f"{100 * source.share:.0f} %"
        rows.append([SOURCES.get(name, name), *own, share, _rounded(source.pull_deg, 1.0)])
    head = (
        "source of up",
        "camera's pitch (°)",
        "camera's roll (°)",
        "share",
        "changes the take's up by (°)",
    )
    return table(head, rows) if len(rows) > 1 or image else Markup("")


def _rounded(value: float | None, bound: float | None) -> str | None:
    """A figure to the digits that its 90 % bound leaves."""
    if value is None or bound is None:
        return None
    stated = bound_in_words(bound)
    digits = 1 if "." in stated else 0
    return f"{value:z.{digits}f}" + (f" ± {stated}" if bound != 1.0 else "")


def provenance(facts: Facts, take: Take) -> Markup:
    """What was read and what was done to it: files by their SHA-256, versions, options."""
    keys, poses = ("role", "file", "adapter", "sha256"), facts.poses
    files = [tuple(str(entry.get(key, "–")) for key in keys) for entry in take.inputs]
    about = [
        f"pcnet3d {package_version()}.",
        f"Rectified by {facts.rectified.method}: {facts.turned} of {how_many(len(poses), 'frame')}.",
        f"Lengths are in {_UNITS.get(poses.frame.unit, poses.frame.unit)}.",
        f"Poses: {'video ' * (take.video is not None)}frames {poses.frame_index[0]} to {poses.frame_index[-1]}, "
        f"person {poses.person}.",
        f"Axes of the poses before they were turned upright: {poses.frame}.",
    ]
    if take.video is not None:
        video = take.video
        about.append(
            f"Video: {video.width} x {video.height} pixels, {how_many(len(video.time_s), 'frame')}"
            f"{rate_in_words(video.fps, ' at ')}, "
            f"{video.codec}" + (f", turned by {video.rotation_deg}°." if video.rotation_deg else ".")
        )
    if seams := poses.seams:
        times = ", ".join(f"{poses.times[seam]:.2f}" for seam in seams[:_MOST])
        about.append(
            f"New clips begin at {times}{' ...' if len(seams) > _MOST else ''} s; poses may jump there."
        )
    steps = [(step.name, step.version, _options(step.options)) for step in facts.history]
    return (
        bullets(about)
        + table(("input", "file", "read as", "SHA-256"), files)
        + box("Notes", _most(facts.notes))
        + details(
            "What was done to the poses, step by step",
            table(("step", "version", "options and counts"), steps),
        )
    )


def _most(texts: Sequence[str]) -> list[str]:
    more = len(texts) - _MOST
    return [*texts[:_MOST], f"and {more} more, in summary.json"] if more > 0 else list(texts)


def _options(options: Mapping[str, Any]) -> str:
    said = ", ".join(
        f"{key} {value:.6g}" if isinstance(value, float) else f"{key} {value}"
        for key, value in options.items()
    )
    return said if len(said) <= _LONGEST else f"{said[:_LONGEST]}…"
