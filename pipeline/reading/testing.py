"""Whether an adapter keeps what pipeline/plugins/protocols.py asks of it, shown on a golden file; for adapters'
tests, anybody's.

A golden file is a small one in the upstream's exact layout: at least 20 frames of a person with bent knees, and two
people with different scores where the format can hold them.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

import numpy as np

from ..core.errors import InputError
from ..core.frames import IMAGE
from ..core.pose import PoseSequence
from ..plugins import registry
from ..plugins.options import call
from ..plugins.protocols import Adapter
from .load import Gives, Source, find_adapter

_GARBAGE = {
    "an empty file": b"",
    "bytes of all values": bytes(range(256)) * 40,
    "plain text": b"frame,time_s,x,y,z\nnothing of any adapter's\n" * 40,
    "other JSON": b'[{"frame": 1, "points": [[1, 2], [3, 4]]}]',
    "the beginning of a zip archive": b"PK\x03\x04" + bytes(400),
    "the beginning of a MATLAB file": b"MATLAB 5.0 MAT-file" + bytes(200),
    "the beginning of a numpy array": b"\x93NUMPY\x01\x00" + bytes(400),
}


def check_adapter(
    name: str, golden: Path, *, mirrored: Path | None = None, by_name: bool = False, **options: Any
) -> tuple[Any, ...]:
    """What the registered adapter of that name reads from a golden file; AssertionError for a broken promise, or what
    the adapter raises.

    mirrored: the same file of a mirrored person. Without it, what is read from the golden file is mirrored, which does
    not test joints that the adapter makes out of others.
    by_name: the adapter recognises no file by content and always has to be named. options: the adapter's own.
    Checked: the protocol's attributes; that only this adapter recognises the file; types, frame, unit and scores of
    what is read; that left and right are right, and a mirrored copy is refused (3D); that other, damaged and missing
    files are not recognised, and that reading them raises InputError and nothing else.
    """
    adapter = registry.load("adapters", name)
    _expect(adapter.name == name, f"its name is '{adapter.name}', its entry point's '{name}'")
    _expect(adapter.gives in get_args(Gives), f"it gives '{adapter.gives}', not one of {get_args(Gives)}")
    _expect(bool(adapter.reads) and "\n" not in adapter.reads, "what it reads is not described in one line")
    _expect(adapter.sniff(golden) is not by_name, f"it recognises {golden.name}: {by_name}")
    _expect(by_name or find_adapter(golden).name == name, "another adapter takes its golden file")

    def read(path: Path) -> tuple[Any, ...]:
        return call(adapter.read, path, what=f"Adapter '{name}'", options=options)

    people = read(golden)
    of_people = adapter.gives in ("poses", "keypoints")
    wanted = PoseSequence if of_people else object
    right = (
        isinstance(people, tuple) and len(people) > 0 and all(isinstance(person, wanted) for person in people)
    )
    _expect(right, f"it reads {people!r:.60}, not a tuple of what it gives")
    _check_garbage(adapter, golden, read)
    if of_people:
        _check_people(adapter, people)
    if adapter.gives == "poses":
        copies = (
            read(mirrored)
            if mirrored
            else tuple(person.with_(joints=person.joints * [-1, 1, 1]) for person in people)
        )
        _check_guard(adapter, golden, people, copies)
    return people


def _expect(kept: bool, otherwise: str) -> None:
    if not kept:
        raise AssertionError(otherwise)


def _check_people(adapter: Adapter, people: tuple[PoseSequence, ...]) -> None:
    frame = people[0].frame
    if adapter.gives == "keypoints":
        _expect((frame.axes, frame.unit) == (IMAGE.axes, "px"), f"keypoints are in {frame}, not in {IMAGE}")
    else:
        _expect(frame.family in ("camera", "world"), f"poses are in {frame}, which no source has")
        _expect(frame.unit != "px", "pixels are no unit of 3D poses; call it arbitrary")
    _expect(len({poses.person for poses in people}) == len(people), "two people have the same name")
    scores = np.concatenate([poses.confidence[np.isfinite(poses.confidence)] for poses in people])
    alike = len(scores) > 1 and np.ptp(scores) == 0
    _expect(not alike, "all scores are equal: make them NaN, or give the golden file different ones")


def _check_guard(
    adapter: Adapter, golden: Path, people: tuple[PoseSequence, ...], mirrored: tuple[PoseSequence, ...]
) -> None:
    source = Source(golden, adapter.name, people, str(golden))
    for poses in people:
        notices = source.normalised(poses).notices
        said = " ".join(each.text for each in notices if each.about == "left and right")
        _expect(not said, f"left and right of person {poses.person} are not certain: {said}")
    for poses in mirrored:
        try:
            source.normalised(poses)
        except InputError:
            continue
        raise AssertionError(
            f"a mirrored person {poses.person} is not refused: the golden file needs 20 frames with bent knees"
        )


def _check_garbage(adapter: Adapter, golden: Path, read: Callable[[Path], Any]) -> None:
    with TemporaryDirectory() as folder:
        places = {"a folder": Path(folder), "no file": Path(folder) / f"none{golden.suffix}"}
        for number, (what, content) in enumerate(_GARBAGE.items()):
            places[what] = _rewritten(golden, Path(folder) / str(number), lambda _, new=content: new)
        for what, path in places.items():
            _expect(adapter.sniff(path) is False, f"it recognises {what}")
            _expect(not _reads(read, path), f"it reads {what}")
        damaged = _rewritten(golden, Path(folder) / "half", lambda whole: whole[: len(whole) // 2])
        adapter.sniff(damaged)
        _reads(read, damaged)  # half a table may still be one


def _rewritten(golden: Path, folder: Path, change: Callable[[bytes], bytes]) -> Path:
    """A copy of the file or folder, under its own name, whose files' bytes are changed."""
    folder.mkdir()
    copy = folder / golden.name
    shutil.copytree(golden, copy) if golden.is_dir() else shutil.copy(golden, copy)
    for file in copy.rglob("*") if copy.is_dir() else [copy]:
        if file.is_file():
            file.write_bytes(change(file.read_bytes()))
    return copy


def _reads(read: Callable[[Path], Any], path: Path) -> bool:
    """Whether the file is read; False where an InputError refuses it."""
    try:
        read(path)
    except InputError:
        return False
    return True
