"""What a command says of finished runs: the result first, how far it can be trusted, what changes a decision, and where
its files are."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..core.messages import how_many, is_verbose, say
from ..core.notices import Notice, grave
from ..core.system import quoted
from ..core.take import Take
from ..files.names import RECORDING, find_page
from ..reading.take import Person
from .sentences import answer, length_of, trusted

_MOST = 3  # notices of a command; the rest is in the report
_FIRST = "person-chosen"  # who was visible and left out comes before the result
_SAID_BEFORE = (_FIRST, "not-levelled")  # or in the verdict
# Graver ones are in the verdict, and a mark is a place in the recording.
_SAID = ("note", "repair", "warning")


def conclude(takes: Mapping[str, Take], folder: Path, within: str = "") -> None:
    """Print what came of each take by its name, how far that can be trusted, what changes a decision, and where the
    files are: in `folder`, of several takes the first's `within` it."""
    for who, take in takes.items():
        for each in take.notices:
            if each.code == _FIRST:
                print(f"{who}{each.text}")
        print(f"{who}{' '.join([f'{length_of(take)}.', *answer(take)])}")
        if doubts := trusted(take):
            print(f"{who}{doubts}")
    more = _say(takes)
    point_to(folder, within)
    if more:
        print(f"{how_many(more, 'more note')} in the report (-v)")


def conclude_people(runs: Sequence[Person], folder: Path) -> None:
    """The same of one person's run or several people's, after who was left out."""
    for run in runs:
        if run.take is None:
            say("warning", f"person {run.name} was left out: {run.refusal}")
    takes = {f"person {run.name}: " * bool(run.folder): run.take for run in runs if run.take}
    conclude(takes, folder, next(run.folder for run in runs if run.take))


def point_to(folder: Path, within: str = "") -> None:
    """Print where the files are, and what opens the page and the recording among them. within: name of the folder that
    has these, where each person has one."""
    page, recording = find_page(folder / within), (folder / within / RECORDING).is_file()
    opened = [] if page is None else [f"open {quoted(page)}"]
    if recording:
        opened.append(f"the recording: pcnet3d view {quoted(folder / within)}")
    each = ", a folder for each person" * bool(within)
    print(f"results in {folder}{each}{': ' * bool(opened)}{'; '.join(opened)}")
    if is_verbose():
        print(f"files: {', '.join(sorted(path.name for path in folder.iterdir()))}")


def _say(takes: Mapping[str, Take]) -> int:
    """Say the notices that change a decision, warnings before notes, what names an option before what does not, each
    code once; with -v all of them. Returns how many are not said."""
    if sys.stdout is not None:
        sys.stdout.flush()  # what was printed stands before what is said on stderr
    whose: dict[Notice, list[str]] = {}
    for who, take in takes.items():
        in_verdict = {finding.text for finding in grave(take.judged)}
        for each in take.notices:
            if each.weight in _SAID and each.code not in _SAID_BEFORE and each.text not in in_verdict:
                whose.setdefault(each, []).append(who)
    chosen = [*whose]
    if not is_verbose():
        of_codes: dict[str, Notice] = {}
        for each in sorted(chosen, key=lambda each: (not each.warns, not each.advises)):
            if each.warns or each.advises:
                of_codes.setdefault(each.code, each)
        chosen = [*of_codes.values()][:_MOST]
    for each in chosen:
        say(each.weight, f"{'' if len(whose[each]) == len(takes) else ''.join(whose[each])}{each.text}")
    return len(whose) - len(chosen)
