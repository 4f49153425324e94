"""Who of a file of motion capture is trained on, and who is held out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from ....pipeline.core.errors import InputError
from ....pipeline.reading.mocap.clip import Clip, read_mocap
from .clips import subject_of

_PARTS = ("train", "val", "test")


class Parts(NamedTuple):
    """The clips of each part ("train", "val", "test"), and what the split lists: "subject", or "clip" where the same
    people may be in several parts."""

    clips: dict[str, tuple[Clip, ...]]
    by: Literal["subject", "clip"]


def read_parts(data: Path, split: Path, needed: Sequence[str] = _PARTS) -> Parts:
    """A file of clips (clips.read_mocap) by a JSON file of subjects: {"train": [...], "val": [...], "test": [...]}.

    A clip's subject is its name up to the first "_". With "by": "clip" the lists hold clip names. InputError when a
    needed part is missing or empty, a name is in two parts, or the data has no such subject or clip.
    """
    clips, (lists, by) = read_mocap(data), _read_split(split)
    if missing := [part for part in needed if not lists.get(part)]:
        raise InputError(
            "nothing-usable",
            f"Expected {by}s for {', '.join(needed)} in {split}; {', '.join(missing)} has none.",
        )
    for part, other in (("train", "val"), ("train", "test"), ("val", "test")):
        if shared := lists.get(part, set()) & lists.get(other, set()):
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


def _read_split(path: Path) -> tuple[dict[str, set[str]], Literal["subject", "clip"]]:
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise InputError(
            "file-damaged", f"Expected a JSON file of train, val and test subjects at {path}: {reason}."
        ) from None
    by = content.get("by", "subject") if isinstance(content, dict) else None
    lists = {part: content[part] for part in _PARTS if part in content} if by else {}
    texts = all(
        isinstance(names, list) and all(isinstance(n, str) for n in names) for names in lists.values()
    )
    if by not in ("subject", "clip") or not texts:
        raise InputError(
            "wrong-content",
            f"Expected lists of names for train, val and test, by subject or clip, in {path}.",
        )
    return {part: set(names) for part, names in lists.items()}, by
