"""Who of a file of motion capture is trained on, and who is held out."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import Any, Literal, NamedTuple

from ....pipeline.core.errors import InputError
from ....pipeline.reading.mocap.clip import Clip, read_mocap
from ..common.toml_config import read_json
from .clips import PARTS, Listed, subject_of


class Parts(NamedTuple):
    """The clips of each part ("train", "val", "test"), and what the split lists: "subject", or "clip" where the same
    people may be in several parts."""

    clips: dict[str, tuple[Clip, ...]]
    by: Literal["subject", "clip"]


def read_parts(data: Path, split: Path, needed: Sequence[str] = PARTS) -> Parts:
    """A file of clips (clips.read_mocap) by a JSON file of subjects: {"train": [...], "val": [...], "test": [...]}.

    A clip's subject is its name up to the first "_". With "by": "clip" the lists hold clip names. InputError when a
    needed part is missing or empty, a name is in two parts, or the data has no such subject or clip.
    """
    clips, listed = read_mocap(data), read_json(split, Listed, "train, val and test subjects in JSON")
    lists, by = {part: getattr(listed, part) for part in PARTS}, listed.by
    if missing := [part for part in needed if not lists[part]]:
        raise InputError(
            "nothing-usable",
            f"Expected {by}s for {', '.join(needed)} in {split}; {', '.join(missing)} has none.",
        )
    for part, other in combinations(PARTS, 2):
        if shared := lists[part] & lists[other]:
            raise InputError(
                "wrong-content",
                f"Expected every {by} in one part of {split} only, but {', '.join(sorted(shared))} is in {part} "
                f"and {other}.",
            )
    key = {clip.name: clip.name if by == "clip" else subject_of(clip.name) for clip in clips}
    if unknown := sorted(set().union(*lists.values()) - set(key.values())):
        raise InputError(
            "name-unknown", f"{split} lists {by}s that {data} does not have: {', '.join(unknown[:10])}."
        )
    return Parts({part: tuple(c for c in clips if key[c.name] in names) for part, names in lists.items()}, by)


def trained_on(config: Any) -> str:
    """Whom a network trains on, as its file says it. config: with `data`, `split`, None without, and `subjects`."""
    return f"{config.data.name}, {config.split.name}" if config.data and config.split else config.subjects
