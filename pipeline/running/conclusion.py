"""The last lines of a command: how far its result can be trusted, what was seen, and which page to open."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from ..core.answer import answer
from ..core.messages import bound_in_words, how_many, show
from ..core.notices import EXIT_CODES, verdict, verdict_words
from ..core.system import quoted
from ..core.take import Take
from ..files.names import RECORDING, find_page
from ..signals.checks import nobody_upright


def conclude(takes: Mapping[str, Take], strict: bool = False) -> int:
    """Print two lines of each take by its name, how far it can be trusted and what was seen, and return the exit code:
    with `strict` that of the worst take, as `trust` has it, else 0."""
    worst = 0
    for who, take in takes.items():
        code, words = trust(take)
        if code:
            words += (
                f" (exit code {code}, as --strict asks)"
                if strict
                else f" (--strict makes the exit code {code})"
            )
        print(f"{who}{words}")
        print(f"{who}{seen(take)}")
        worst = max(worst, code)
    return worst if strict else 0


def show_files(folder: Path) -> None:
    """Name the files of a finished run, and what opens its recording."""
    show(f"{folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")
    if (folder / RECORDING).is_file():
        show(f"the recording: pcnet3d view {quoted(folder)}")


def point_to(folder: Path) -> None:
    """Print the last line, where the folder has a page: what opens it."""
    if (page := find_page(folder)) is not None:
        print(f"open {quoted(page)}")


def trust(take: Take) -> tuple[int, str]:
    """How far a finished take can be trusted, as an exit code and in words: 4 unusable or not levelled, 3 suspicious, 0
    neither. Its poses are judged as by `pcnet3d inspect`."""
    judged = take.judged
    code, words = EXIT_CODES[verdict(judged)], [] if take.findings is None else [verdict_words(judged)]
    if take.rectified is not None:
        levelled, bound = take.rectified.level_ok, take.rectified.up_bound_deg[take.rectified.turned]
        code = code if levelled else EXIT_CODES["unusable"]
        words.append(f"the take is {'' if levelled else 'not '}levelled")
        if not levelled:
            words[-1] += f": {take.rectified.level_reason}"
        elif any(each.code == "up-of-unusable" for each in take.notices):
            words[-1] += ", the error of up is not known"
        elif np.isfinite(bound).any():
            words[-1] += f", up is known to within {bound_in_words(float(np.nanmax(bound)))} degrees"
            words[-1] += " unless the image is turned" if nobody_upright(take.rectified) else ""
        elif take.rectified.in_world:
            words[-1] += ", up comes from the file; its error is not known"
    return code, "; ".join(words)


def seen(take: Take) -> str:
    """What a take shows, in a line: how long it is, and what moved (pipeline/core/answer.py)."""
    rows = take.rows
    if rows is None:
        return "Nobody was seen."
    length = how_many(len(rows), "frame")
    if rows.time_s is not None:
        length = f"{rows.duration_s:.1f} s, {length}"
    return " ".join([f"{length}.", *answer(take)])
