"""The report: report.html, one page about a take to look at, print and hand on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from markupsafe import Markup

from ...pipeline.core.measures import Measure
from ...pipeline.core.system import give_memory_back
from ...pipeline.core.take import Take
from ...pipeline.files.atomic import REPORT, write_text
from ...pipeline.running.sentences import NINE_IN_TEN, headlines
from ...pipeline.running.sentences import answer as answered
from ..drawing.page import Tile, answer, page, small, tiles
from .angles import angle_charts, ranges, sides_compared
from .measures import happened
from .player import skeleton_player
from .sections import provenance_of, session_words
from .trust import trust

_RANGES = "Joint angles: the lowest and the highest of nine in ten frames that show them."
_UNKNOWN = "Where an angle has no ±, its error is not known."


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
    head = session_words(take) + answer(answered(take, sides_compared(measures)) or withheld)
    head += tiles(Tile(*each, large=True) for each in headlines(take)) + _first_notes(take)
    head += skeleton_player(take) + trust(take)
    several = len(poses) > 1  # charts over time of one frame are empty
    sections = [
        ("Ranges of motion", ranges(measures, take.angle_errors)),
        ("Movements", happened(measures, poses.frame.metric)),
        ("Joint angles over time" if several else "Joint angles", angle_charts(take)),
        ("Input and steps", provenance_of(take)),
    ]
    return page(take.title, head, sections, folded=True)


def _first_notes(take: Take) -> Markup:
    """What the figures of the first screen need beside them."""
    shown = [words for _, words in headlines(take)]
    stated = [row.error is not None for row in take.figures if isinstance(row, Measure)]
    notes = [_RANGES] * bool(shown) + [NINE_IN_TEN] * any(stated)
    notes += [_UNKNOWN] * (not all("±" in words for words in shown))
    notes += [each.text for each in take.notices if each.code == "no-scale" and not each.warns]
    return small(" ".join(notes)) if notes and take.figures else Markup("")
