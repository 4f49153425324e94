"""Every code of a refusal: why an input cannot be used, and what a program may do about it."""

from __future__ import annotations

# Why the input cannot be used, and what a program may do; the message says it of the case.
REFUSALS: dict[str, tuple[str, str]] = {
    # Of the files that are read
    "cannot-open": ("The file or folder does not exist, or cannot be opened",
        "correct the path or its permissions"),
    "file-damaged": ("The file is empty, cut short or damaged", "copy or write it again"),
    "format-unknown": ("The file does not have the expected format", "name an adapter, or export it again"),
    "format-ambiguous": ("Several formats fit the file", "name one of those that the message lists"),
    "wrong-content": ("Arrays, columns or names are missing, or have another shape or type than expected",
        "name another adapter, or write them as the message says"),
    "wrong-axes": ("Coordinates have other axes or another unit than expected",
        "state the axes or the unit, or convert them"),
    "sides-swapped": ("The body is mirrored, or left and right are exchanged",
        "look at the take, and state which (`handedness`)"),
    "people-mixed": ("Several people are mixed into one, or are not tracked", "track people first"),
    "files-apart": ("The files belong to different recordings, or have different settings", "leave one out"),
    "times-broken": ("Times or frame numbers do not increase as they should", "write them again"),
    "nothing-usable": ("There is no person, no pose, or too little data", "leave this take out"),
    "unsafe": ("The file tries to run code, to use too much memory, or to reach paths outside its folder",
        "do not use it, or write it in another form"),
    # Of what is asked for
    "bad-value": ("A value has the wrong type, or is outside its range", "correct the value"),
    "name-unknown": ("There is no option, stage, adapter, network, person or joint with that name",
        "correct the name; the message lists the nearest ones"),
    "option-conflict": ("Options exclude each other, or this run cannot use one", "leave one out"),
    "choose-person": ("There are several people", "name one (`person`)"),
    "choose-entry": ("The file or folder holds several cameras, clips, arrays or runs", "name one"),
    "needs-rate": ("No file states the frame rate", "give it (`fps`)"),
    "needs-input": ("A file or a value is needed, but was not given", "give it"),
    "needs-stage": ("A stage needs something that no earlier stage gives",
        "add the stage that gives it, or put it earlier"),
    # Of the machine and of what is installed
    "needs-package": ("A package or program is not installed", "install it"),
    "plugin-broken": ("An installed package does not work as it should", "repair or uninstall it"),
    "wrong-network": ("The network in the file is not of the kind that is needed", "give another network"),
    "no-device": ("The device or the screen does not exist, or has no memory left", "choose another"),
    "not-reached": ("A server, camera, stream or cluster cannot be reached", "try again later"),
    "other-version": ("Results or data come from another version", "install that version, or start again"),
    "already-there": ("The output folder holds something else, or is in use", "choose another place"),
    "cannot-write": ("The output cannot be written, or the disk is full",
        "make room, or choose another place"),
}  # fmt: skip


def listed() -> list[dict[str, str]]:
    """Rows of `pcnet3d list refusals`, each with three texts."""
    return [{"code": code, "why": why, "what to do": act} for code, (why, act) in REFUSALS.items()]
