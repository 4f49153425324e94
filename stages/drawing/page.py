"""A page of HTML that needs nothing but itself: images inside, no address of any other place, and no script but ours
that sort tables and read off charts, where there are such."""

from __future__ import annotations

import json
import re
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal, NamedTuple

from jinja2 import Environment, FileSystemLoader
from markupsafe import Markup, escape

# Even if a text of a stranger's file came through unescaped, a browser would load and run nothing.
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'"

# On paper each page has the title and its number.
_PAPER = """@media print {{ @page {{
  @bottom-left {{ content: "{title}"; font: 7.5pt sans-serif; color: #5b6470 }}
  @bottom-right {{ content: counter(page) " / " counter(pages); font: 7.5pt sans-serif; color: #5b6470 }} }} }}
"""
_OPTION = re.compile(r"(?<![\w-])--\w[\w-]*")
_NARROW = 4  # columns that a telephone is wide enough for
_SCRIPTS = {
    '<details class="part"': "fold.js",
    '<table class="sortable">': "sort.js",
    '<div class="chart"': "charts.js",
    '<figure class="player"': "player.js",
}


@cache
def kit(name: str = "page.html.j2") -> Any:
    """The macros of a template beside this module; whatever they are given that is not markup yet is escaped."""
    templates = Environment(loader=FileSystemLoader(Path(__file__).parent), autoescape=True)
    templates.filters["unbroken"] = unbroken
    return templates.get_template(name).module


def unbroken(words: str) -> Markup:
    """Words, escaped unless they are markup already, in which no line ends inside an option such as --set."""
    return (
        words
        if isinstance(words, Markup)
        else Markup(_OPTION.sub(r'<span class="option">\g<0></span>', str(escape(words))))
    )


def _text(name: str) -> str:
    return Path(__file__).with_name(name).read_text(encoding="utf-8")


class Link(NamedTuple):
    """Words that lead to another file. address: relative to the page, already as a URL writes it."""

    words: str
    address: str


class Number(NamedTuple):
    """A number as it is to be read, maybe with its error; a column of these is one of numbers."""

    words: str


class Soft(NamedTuple):
    """Words in grey: a figure that says nothing by itself."""

    words: str


class Tile(NamedTuple):
    """A figure that stands alone: its name, its value with error and unit, and a line about what it is. soft: in grey,
    since it says nothing by itself. large: one of the few to be read first."""

    name: str
    value: str
    about: str = ""
    soft: bool = False
    large: bool = False


Level = Literal["good", "care", "bad"]
Cell = str | int | Link | Soft | Number | None  # a str that is Markup is left as it is


def page(title: str, head: Markup, sections: Iterable[tuple[str, Markup]], folded: bool = False) -> str:
    """A whole document. head: HTML under the title. sections: each one's title in words and its HTML; empty ones are
    left out. folded: whether a section is shown when its title is clicked; on paper all are."""
    kept = [(f"part-{i}", name, content) for i, (name, content) in enumerate(sections, 1) if content]
    whole = kit().parts(kept, folded)
    wanted = [file for mark, file in _SCRIPTS.items() if mark in whole or mark in head]
    script, policy = "".join(map(_text, wanted)), _POLICY
    if script:
        policy += f"; script-src 'sha256-{b64encode(sha256(script.encode()).digest()).decode('ascii')}'"
    style = _text("page.css") + _PAPER.format(title=_css_string(title))
    return str(kit().page(title, head, kept, whole, Markup(style), Markup(script), policy))


def _css_string(words: str) -> str:
    """The words as a string of CSS, in which everything but letters and digits of ASCII is written by its number."""
    return "".join(c if c.isascii() and c.isalnum() else f"\\{ord(c):x} " for c in words)


def heading(words: str, level: int = 3) -> Markup:
    """level: 3 for a part of a section, 4 for a part of that."""
    return kit().heading(words[:1].upper() + words[1:], level)


def small(words: str) -> Markup:
    """A paragraph that explains."""
    return kit().small(words)


def answer(sentences: Iterable[str]) -> Markup:
    """What a page has to say, in large words; nothing when there are none."""
    sentences = list(sentences)
    return kit().answer(sentences) if sentences else Markup("")


def gauge(
    level: Level, word: str, sentence: str, checks: Iterable[tuple[str, Level, Sequence[str]]]
) -> Markup:
    """How far something can be trusted: the level on a scale of three, in a word and a sentence, and what it rests on,
    on demand where there is nothing to look at. checks: name, level and sentences of each."""
    return kit().gauge(level, word, sentence, list(checks))


def tiles(items: Iterable[Tile]) -> Markup:
    """Figures side by side, each with what it is on demand; nothing when there are none."""
    items = sorted(items, key=lambda tile: not tile.large)
    return kit().figures(items) if items else Markup("")


def bullets(items: Iterable[str]) -> Markup:
    """An HTML list of texts; nothing when there are none."""
    items = list(items)
    return kit().bullets(items) if items else Markup("")


def box(heading: str, items: Sequence[str], kind: Literal["plain", "warning"] = "plain") -> Markup:
    """A list that is not to be overlooked; nothing when it is empty."""
    return kit().box(heading, items, kind) if items else Markup("")


def table(head: Sequence[str], rows: Sequence[Sequence[Cell]], sortable: bool = False) -> Markup:
    """The first cell of a row is its heading; None is a dash. On a telephone the rows of a wide table stand one below
    the other, each cell with its column's name. sortable: a click on a column's heading sorts by it."""
    if not rows:
        return Markup("")
    filled = [[cell for cell in cells if cell is not None] for cells in zip(*rows, strict=True)]
    right = [bool(cells) and all(isinstance(cell, int | Number) for cell in cells) for cells in filled]
    names = [("number" if number else "", name, "") for name, number in zip(head, right, strict=True)]
    lines = [[_cell(*cell) for cell in zip(row, right, strict=True)] for row in rows]
    wide = len(head) > _NARROW or any(kind == "long" for line in lines for kind, *_ in line)
    return kit().table(names, lines, sortable, wide and not sortable)


def _breaking(name: str) -> Markup:
    """A file's or a take's name, which may go on in a new line behind an underscore."""
    return Markup("_<wbr>").join(name.split("_"))


def _cell(cell: Cell, number: bool) -> tuple[str, str, str]:
    """Its class, words and address. number: of a column of numbers."""
    if isinstance(cell, Soft | Number):
        words = cell.words
    elif isinstance(cell, Link):
        words = _breaking(cell.words)
    else:
        words = cell if isinstance(cell, str) else "–" if cell is None else str(cell)
    long = len(words) > 40 and not isinstance(cell, Markup)
    kind = "soft" if isinstance(cell, Soft) else "number" if number else "long" if long else ""
    return kind, words, cell.address if isinstance(cell, Link) else ""


def figure(picture: Markup, title: str, caption: str = "") -> Markup:
    """An image or chart between its title and more words."""
    return kit().figure(picture, title, caption)


def player(held: Mapping[str, Any], frames: int, alt: str, caption: str, film: str = "") -> Markup:
    """A skeleton to play and to turn, and beside it a film, if one is held; player.js says what is held. alt, film: of
    either, for those who cannot see it."""
    return kit().player(json.dumps(held, separators=(",", ":")), frames, alt, caption, film)


def jpeg_address(content: bytes) -> str:
    """A JPEG as an address that holds it."""
    return f"data:image/jpeg;base64,{b64encode(content).decode('ascii')}"


def charts(figures: Iterable[Markup]) -> Markup:
    """Figures in as many columns as there is room for, on paper three."""
    figures = list(figures)
    return kit().charts(figures) if figures else Markup("")


def beside(*parts: Markup) -> Markup:
    """Side by side where there is room."""
    shown = [part for part in parts if part]
    return kit().beside(shown) if shown else Markup("")


def joined(parts: Iterable[Markup]) -> Markup:
    """One after the other."""
    return Markup("").join(parts)
