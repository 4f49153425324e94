"""What is said of a take: notices with codes that programs act on, whose sentences stand in notices.toml."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from string import Formatter
from typing import Any, Literal, NamedTuple

from .messages import how_many

# From the least to the gravest; a mark is a place in the recording. The last two are verdicts on poses.
Weight = Literal["mark", "note", "repair", "warning", "suspicious", "unusable"]
About = Literal["", "poses", "left and right", "view", "up", "camera", "clock", "place", "motion", "files"]

EXIT_CODES = {"good": 0, "suspicious": 3, "unusable": 4}  # of a program that judges poses
WARNS = ("warning", "suspicious", "unusable")


class Entry(NamedTuple):
    """Of the catalogue: a notice's weight, unless the one who says it weighs it, its subject, and the template of its
    sentence."""

    weight: Weight
    about: About
    text: str


@cache
def catalogue() -> dict[str, Entry]:
    """Every notice of pcnet3d by its code (notices.toml)."""
    entries = tomllib.loads(Path(__file__).with_name("notices.toml").read_text(encoding="utf-8"))
    return {code: Entry(**fields) for code, fields in entries.items()}


class _Sentences(Formatter):
    """Templates as of str.format, and two more formats: {n:~row} and {n:~pose was/poses were} are a count with its
    words, {n:?is/are} the words alone."""

    def format_field(self, value: Any, format_spec: str) -> str:
        kind, forms = format_spec[:1], format_spec[1:].partition("/")
        if kind == "~":
            return how_many(value, forms[0], forms[2])
        if kind == "?":
            return forms[0] if value == 1 else forms[2]
        return super().format_field(value, format_spec)


_SENTENCES = _Sentences()


@dataclass(frozen=True)
class Notice:
    """One thing to know of a take; made by `notice` or `own_notice`.

    code: for programs: a code of the catalogue, or of another package, with a prefix that ends with a dot. weight: how
    grave it is; the gravest about the poses is their verdict. about: what it is about. rows: rows of the poses after
    `clean` at which it begins; None for the whole take, and before there were such rows. values: plain figures and
    words for its sentence.
    """

    code: str
    weight: Weight
    about: About = ""
    rows: tuple[int, ...] | None = None
    values: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def text(self) -> str:
        """Its sentence."""
        if "text" in self.values:  # another package's, or another version's
            return str(self.values["text"])
        return _SENTENCES.vformat(catalogue()[self.code].text, (), self.values)

    @property
    def warns(self) -> bool:
        """Whether it is graver than a note or a repair."""
        return self.weight in WARNS

    @property
    def advises(self) -> bool:
        """Whether it names an option."""
        return re.search(r"(^|[\s(])-(O |-[a-z])", self.text) is not None

    def as_dict(self) -> dict[str, Any]:
        """As summary.json has it."""
        return {
            "code": self.code,
            "weight": self.weight,
            "about": self.about,
            "text": self.text,
            "rows": None if self.rows is None else list(self.rows),
            "values": dict(self.values),
        }


def notice(
    code: str, *, rows: Iterable[int] | None = None, weight: Weight | None = None, **values: Any
) -> Notice:
    """A notice of the catalogue. rows, values: as in Notice; weight: if it is not the catalogue's. KeyError for an
    unknown code, or if its sentence lacks a value."""
    entry = catalogue()[code]
    made = Notice(
        code, weight or entry.weight, entry.about, None if rows is None else tuple(map(int, rows)), values
    )
    _ = made.text  # fails here, where it is made, when a value lacks
    return made


def own_notice(
    code: str,
    text: str,
    weight: Weight = "warning",
    *,
    about: About = "",
    rows: Iterable[int] | None = None,
    **values: Any,
) -> Notice:
    """A notice of another package. code: with the package's name before a dot, such as "mypackage.dark-video".
    text: its sentence. ValueError for a code without a prefix."""
    if not all(code.partition(".")):
        raise ValueError(
            f"Expected a code with a prefix, such as 'mypackage.{code or 'code'}', got '{code}'."
        )
    return Notice(
        code, weight, about, None if rows is None else tuple(map(int, rows)), {**values, "text": text}
    )


def without_doubles(notices: Iterable[Notice]) -> tuple[Notice, ...]:
    """Each of them once, in their order: doubles have the same code, rows and values."""
    return tuple(dict.fromkeys(notices))


def verdict(findings: Iterable[Notice]) -> str:
    """The gravest finding about poses: "good", "suspicious" or "unusable"."""
    weights = {finding.weight for finding in findings}
    return next((weight for weight in ("unusable", "suspicious") if weight in weights), "good")


def grave(findings: Iterable[Notice]) -> tuple[Notice, ...]:
    """Those that make poses less than good."""
    return tuple(finding for finding in findings if finding.weight in ("suspicious", "unusable"))


class _Name(str):
    """A value's name, whatever the value's format."""

    def __format__(self, format_spec: str) -> str:
        return str(self)


def listed() -> list[dict[str, str]]:
    """Rows of `pcnet3d list notices`, each with three texts; a value is its name between asterisks."""
    rows = []
    for code, entry in catalogue().items():
        names = {name: _Name(f"*{name}*") for _, name, _, _ in _SENTENCES.parse(entry.text) if name}
        text = _SENTENCES.vformat(entry.text, (), names)
        rows.append({"code": code, "weight": entry.weight, "what it says": text})
    return rows
