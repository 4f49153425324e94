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
    "cannot-open": Meaning("The file or folder does not exist, or cannot be opened",
        "correct the path or its permissions"),
    "file-damaged": Meaning("The file is empty, cut short or damaged", "copy or write it again"),
    "format-unknown": Meaning("The file does not have the expected format", "name an adapter, or export it again"),
    "format-ambiguous": Meaning("Several formats fit the file", "name one of those that the message lists"),
    "wrong-content": Meaning("Arrays, columns or names are missing, or have another shape or type than expected",
        "name another adapter, or write them as the message says"),
    "wrong-axes": Meaning("Coordinates have other axes or another unit than expected",
        "state the axes or the unit, or convert them"),
    "sides-swapped": Meaning("The body is mirrored, or left and right are exchanged",
        "look at the take, and state which (`handedness`)"),
    "people-mixed": Meaning("Several people are mixed into one, or are not tracked", "track people first"),
    "files-apart": Meaning("The files belong to different recordings, or have different settings", "leave one out"),
    "times-broken": Meaning("Times or frame numbers do not increase as they should", "write them again"),
    "nothing-usable": Meaning("There is no person, no pose, or too little data", "leave this take out"),
    "unsafe": Meaning("The file tries to run code, to use too much memory, or to reach paths outside its folder",
        "do not use it, or write it in another form"),
    # Of what is asked for
    "bad-value": Meaning("A value has the wrong type, or is outside its range", "correct the value"),
    "name-unknown": Meaning("There is no option, stage, adapter, network, person or joint with that name",
        "correct the name; the message lists the nearest ones"),
    "option-conflict": Meaning("Options exclude each other, or this run cannot use one", "leave one out"),
    "choose-person": Meaning("There are several people", "name one (`person`)"),
    "choose-entry": Meaning("The file or folder holds several cameras, clips, arrays or runs", "name one"),
    "needs-rate": Meaning("No file states the frame rate", "give it (`fps`)"),
    "needs-input": Meaning("A file or a value is needed, but was not given", "give it"),
    "needs-stage": Meaning("A stage needs something that no earlier stage gives",
        "add the stage that gives it, or put it earlier"),
    # Of the machine and of what is installed
    "needs-package": Meaning("A package or program is not installed", "install it"),
    "plugin-broken": Meaning("An installed package does not work as it should", "repair or uninstall it"),
    "wrong-network": Meaning("The network in the file is not of the kind that is needed", "give another network"),
    "no-device": Meaning("The device or the screen does not exist, or has no memory left", "choose another"),
    "not-reached": Meaning("A server, camera, stream or cluster cannot be reached", "try again later"),
    "other-version": Meaning("Results or data come from another version", "install that version, or start again"),
    "already-there": Meaning("The output folder holds something else, or is in use", "choose another place"),
    "cannot-write": Meaning("The output cannot be written, or the disk is full",
        "make room, or choose another place"),
}  # fmt: skip

assert set(REFUSALS) == set(get_args(Refusal))


def listed() -> list[dict[str, str]]:
    """Rows of `pcnet3d list refusals`, each with three texts."""
    return [
        {"code": code, "why": meaning.means, "what to do": meaning.act} for code, meaning in REFUSALS.items()
    ]
