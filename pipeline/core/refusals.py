"""Every code of a refusal: why an input cannot be used, and what a program may do about it."""

from __future__ import annotations

from typing import Literal, NamedTuple, get_args

Refusal = Literal[
    "cannot-open", "file-damaged", "format-unknown", "format-ambiguous", "wrong-content", "wrong-axes",
    "sides-swapped", "people-mixed", "files-apart", "times-broken", "nothing-usable", "unsafe", "bad-value",
    "name-unknown", "option-conflict", "choose-person", "choose-entry", "needs-rate", "needs-input",
    "needs-stage", "needs-package", "plugin-broken", "wrong-network", "no-device", "not-reached",
    "other-version", "already-there", "cannot-write",
]  # fmt: skip


class Meaning(NamedTuple):
    """means: why the input cannot be used. act: what a program may do; the message says it of the case."""

    means: str
    act: str


REFUSALS: dict[Refusal, Meaning] = {
    # Of the files that are read
    "cannot-open": Meaning("No such file or folder, or it may not be opened", "correct the path or its permissions"),
    "file-damaged": Meaning("The file is empty, cut short or damaged", "copy or write it again"),
    "format-unknown": Meaning("The file is of another format than was expected", "name an adapter, or export it anew"),
    "format-ambiguous": Meaning("Several formats fit the file", "name one of those that the message lists"),
    "wrong-content": Meaning("Arrays, columns or names are missing, or of another shape or kind than expected",
        "name another adapter, or write them as the message says"),
    "wrong-axes": Meaning("Coordinates are in other axes or another unit than expected",
        "say the axes or the unit, or convert them"),
    "sides-swapped": Meaning("The body is mirrored, or left and right are exchanged",
        "say which (`handedness`), after a look at the take"),
    "people-mixed": Meaning("Several people are taken for one, or are not tracked", "track people first"),
    "files-apart": Meaning("Files of different recordings, or of different settings", "leave one out"),
    "times-broken": Meaning("Times or frame numbers do not increase as they should", "write them again"),
    "nothing-usable": Meaning("There is nobody, no pose, or too little of it", "leave this take out"),
    "unsafe": Meaning("The file asks for what a file may not: to run code, for too much memory, for paths outside",
        "leave it alone, or write it in another form"),
    # Of what is asked for
    "bad-value": Meaning("A value is of another type, or outside its range", "correct the value"),
    "name-unknown": Meaning("There is no option, stage, adapter, network, person or joint of that name",
        "correct the name; the message has the nearest ones"),
    "option-conflict": Meaning("Options exclude each other, or this run has no use for one", "leave one out"),
    "choose-person": Meaning("There are several people", "name one (`person`)"),
    "choose-entry": Meaning("The file or folder holds several cameras, clips, arrays or runs", "name one"),
    "needs-rate": Meaning("Nothing says the frame rate", "give it (`fps`)"),
    "needs-input": Meaning("A file or a value is needed that was not given and that no file holds", "give it"),
    "needs-stage": Meaning("Something is needed that no stage before gives", "add that stage, or put it earlier"),
    # Of the machine and of what is installed
    "needs-package": Meaning("A package or program is not installed", "install it"),
    "plugin-broken": Meaning("An installed package does not do what it must", "repair or uninstall it"),
    "wrong-network": Meaning("The file of a network is not of the kind that is needed", "give another"),
    "no-device": Meaning("The device or the screen is not there, or has no memory left", "choose another"),
    "not-reached": Meaning("A server, camera, stream or cluster cannot be reached", "try again later"),
    "other-version": Meaning("Results or data are of another version", "install that one, or begin anew"),
    "already-there": Meaning("The place of the output holds something else, or is in use", "choose another place"),
    "cannot-write": Meaning("The output cannot be written, or there is no room for it",
        "make room, or choose another place"),
}  # fmt: skip

assert set(REFUSALS) == set(get_args(Refusal))


def refusals_table() -> str:
    """The codes as a table in Markdown, as docs/notices.md has it."""
    rows = [f"| `{code}` | {why.means} | {why.act} |" for code, why in REFUSALS.items()]
    return "\n".join(["| refusal | why | what to do |", "| --- | --- | --- |", *rows]) + "\n"
