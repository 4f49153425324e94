"""The report: report.html, one page about a take to look at, print and hand on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from markupsafe import Markup

from ...pipeline.core.measures import Measure
from ...pipeline.core.messages import how_many, rate_in_words
from ...pipeline.core.system import give_memory_back
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import REPORT, write_text
from ...pipeline.running.sentences import NINE_IN_TEN, camera_motion, camera_words, headlines, length_of
from ...pipeline.running.sentences import answer as answered
from ..drawing.facts import provenance
from ..drawing.page import Tile, answer, box, joined, page, small, table, tiles
from .angles import angle_charts, ranges, sides_compared
from .measures import happened
from .player import skeleton_player
from .trust import trust

_RANGES = "Joint angles: the lowest and the highest of nine in ten frames that show them."
_UNKNOWN = "Where an angle has no ±, its error is not known."
_MOST = 40  # notices of one kind
_HEADINGS = {  # where not the person's own
    "camera": "towards the camera, and to the camera's left",
    "world": "those of the file's world",
}


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
        write_text(self.folder / REPORT, report(take))
        return take


def report(take: Take) -> str:
    """A take as one HTML page that holds its images, loads nothing, and runs no script but our own for reading off its
    charts.

    On the first screen what was seen, in words and figures, the video beside the upright skeleton, and how far to trust
    it; folded, ranges of motion, movements, angles, and the run's input and steps. What the take lacks (video, angles,
    measures, ...) is left out; so are the video's images where `take.told.images` is False. Raises InputError without
    poses, rectified poses or time stamps, or when the video cannot be decoded.
    """
    poses, measures = take.need("poses"), take.figures
    take.need("rectified")
    give_memory_back()
    withheld = [each.text for each in take.notices if each.code == "figures-withheld"]
    head = _session(take) + answer(answered(take, sides_compared(measures)) or withheld)
    head += tiles(Tile(*each, large=True) for each in headlines(take)) + _first_notes(take)
    head += skeleton_player(take) + trust(take)
    several = len(poses) > 1  # charts over time of one frame are empty
    sections = [
        ("Ranges of motion", ranges(measures, take.angle_errors)),
        ("Movements", happened(measures, poses.frame.metric)),
        ("Joint angles over time" if several else "Joint angles", angle_charts(take)),
        ("Input and steps", _inputs(take)),
    ]
    return page(take.title, head, sections, folded=True)


def _session(take: Take) -> Markup:
    """Whom and what the page is about, under its title: person and date, if given, the take's name, its length and the
    camera."""
    motion = camera_motion(take) if len(take.need("poses")) > 1 else ""
    parts = [
        f"Person {take.session.person_id}" if take.session.person_id else "",
        take.session.date,
        take.name if take.name != take.title else "",
        length_of(take),
        f"camera {motion}" if motion else "",
    ]
    return small(" · ".join(part for part in parts if part))


def _first_notes(take: Take) -> Markup:
    """What the figures of the first screen need beside them."""
    shown = [words for _, words in headlines(take)]
    stated = [row.error is not None for row in take.figures if isinstance(row, Measure)]
    notes = [_RANGES] * bool(shown) + [NINE_IN_TEN] * any(stated)
    notes += [_UNKNOWN] * (not all("±" in words for words in shown))
    notes += [each.text for each in take.notices if each.code == "no-scale" and not each.warns]
    return small(" ".join(notes)) if notes and take.figures else Markup("")


def _inputs(take: Take) -> Markup:
    """Inputs, how they were read and versions, as in every file of the run, how the camera stands and which way front
    is; then the repairs and the notes."""
    poses, rectified = take.need("poses"), take.need("rectified")
    lines = {
        "poses": f"person {poses.person}, frames {poses.frame_index[0]} to {poses.frame_index[-1]}, {poses.frame}",
        "rectified": f"{rectified.turned.sum()} of {how_many(len(poses), 'frame')}",
    }
    if not rectified.in_world:
        relative = "; front and right are relative to it" if rectified.camera == "moving" else ""
        lines["camera"] = f"it {camera_words(take)}{relative}"
        lines["front and right"] = _HEADINGS.get(rectified.level_heading, "the person's own")
    if (video := take.video) is not None:
        turned = f", turned by {video.rotation_deg}°" if video.rotation_deg else ""
        lines["video"] = (
            f"{video.width} x {video.height} pixels, {how_many(len(video.time_s), 'frame')}"
            f"{rate_in_words(video.fps, ' at ')}, {video.codec}{turned}"
        )
    shown = {name: text for name, text in provenance(take).items() if not name.startswith("warning")}
    boxes = []
    for title, texts in (("Repairs", take.texts("repair")), ("Notes", take.texts("note"))):
        more = [f"and {len(texts) - _MOST} more, in summary.json"] * (len(texts) > _MOST)
        boxes.append(box(title, [*texts[:_MOST], *more]))
    return table(("", ""), [*(shown | lines).items()]) + joined(boxes)
