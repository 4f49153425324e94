"""Documents, help texts and notices use plain words: none of the private ones that stopped readers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from pcnet3d.pipeline.cli import load_command
from pcnet3d.pipeline.core import errors, notices
from pcnet3d.pipeline.plugins import registry

ROOT = Path(__file__).parents[2]
WRITTEN = [ROOT / name for name in ("README.md", "CHANGELOG.md", "CONTRIBUTING.md")]
DOCUMENTS = [*WRITTEN, *(ROOT / "docs").glob("*.md"), *(ROOT / "models").rglob("card.md")]

# What each would better be: a name of the person or the thing, a verb of the field, the usual order of words.
PRIVATE = (
    r"of whom",
    r"of who\b",
    r"whoever",
    r"nobody (?:knows|has judged|has said|tells)",
    r"(?:^|[.;:,] )who (?:glides|stands|lies|walks|lands|kneels|holds|begins|swings)\b",
    r"every so manieth",
    r"(?:a|one) (?:frame|stage) alone",
    r"before a (?:moving|static|still|level)? ?camera",
    r"(?:have|has|had) no say",
    r"(?:tells?|told|telling) up\b",
    r"gone on with",
    r"for want of",
    r"as much again",
    r"without a word",
    r"said of several",
    r"what a (?:take|run|image) (?:shows|says|knows) of",
    r"\bau\b",
    r"a (?:year|minute|second) of so many",
    r"nothing that moves",
)


def problems(text: str) -> list[str]:
    """The private words in a text, in the order of PRIVATE. Code is left out."""
    plain = re.sub(r"```.*?```|`[^`\n]*`|https?://\S+", "", text, flags=re.DOTALL)
    plain = re.sub(r"\s+", " ", plain)
    return [found[0] for words in PRIVATE for found in re.finditer(words, plain, re.IGNORECASE)]


def texts() -> Iterator[tuple[str, str]]:
    """Name and text of every document, of the help of every command, and of all notices and refusals."""
    for path in DOCUMENTS:
        yield path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")
    for name in registry.registered("commands"):
        command = load_command(name)
        options = [getattr(option, "help", None) or "" for option in command.params]
        yield f"pcnet3d {name} --help", "\n\n".join([command.help or "", *options])
    for catalogue in (notices, errors):
        sentences = ("; ".join(list(row.values())[1:]) for row in catalogue.listed())
        yield catalogue.__name__, "\n\n".join(sentences)


def test_plain_words():
    lines = sorted(f"{place}: {words}" for place, text in texts() for words in problems(text))
    assert not lines, "\n".join(["", *lines])
