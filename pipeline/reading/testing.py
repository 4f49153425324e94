"""Whether an adapter keeps what pipeline/plugins/protocols.py asks of it, shown on a golden file; for adapters'
tests, anybody's.

A golden file is a small one in the upstream's exact layout: at least 20 frames of a person with bent knees, and two
people with different scores where the format can hold them.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, get_args

import numpy as np

from ..core.errors import InputError
from ..core.frames import IMAGE
from ..core.pose import PoseSequence
from ..core.take import Video
from ..plugins import registry
from ..plugins.options import call
from ..plugins.protocols import Adapter
from .find import Gives, find_adapter
from .load import Source
from .normalise import Guards

_TYPES = {
    "poses": PoseSequence,
    "keypoints": PoseSequence,
    "video": Video,
}  # of "imu" the adapter has its own
_GARBAGE = {
    "an empty file": b"",
    "bytes of all values": bytes(range(256)) * 40,
    "plain text": b"frame,time_s,x,y,z\nnothing of any adapter's\n" * 40,
    "other JSON": b'[{"frame": 1, "points": [[1, 2], [3, 4]]}]',
    "the beginning of a zip archive": b"PK\x03\x04" + bytes(400),
    "the beginning of a MATLAB file": b"MATLAB 5.0 MAT-file" + bytes(200),
    "the beginning of a numpy array": b"\x93NUMPY\x01\x00" + bytes(400),
}


@dataclass(frozen=True)
class Facts:
    """What a golden file shows of its adapter.

    axes: what x, y, z point at; unit: as in Frame, "" without coordinates.
    fps, frames: whether the file knows its times, and the video frames of its rows.
    people: "one", "named" by the file or "joined" from frame to frame; "" for other things than people.
    scores: whether joints have confidences.
    """

    adapter: str
    gives: str
    axes: str = ""
    unit: str = ""
    fps: bool = False
    frames: bool = False
    people: str = ""
    scores: bool = False


def check_adapter(
    name: str, golden: Path, *, mirrored: Path | None = None, by_name: bool = False, **options: Any
) -> Facts:
    """Check the registered adapter of that name on a golden file; AssertionError for the first broken promise.

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
    _check_alone(adapter, golden, by_name)

    def read(path: Path) -> tuple[Any, ...]:
        return call(adapter.read, path, what=f"Adapter '{name}'", options=options)

    people = read(golden)
    wanted = _TYPES.get(adapter.gives, object)
    _expect(isinstance(people, tuple) and len(people) > 0, f"it reads a {type(people).__name__}, not a tuple")
    _expect(
        all(isinstance(person, wanted) for person in people), f"it reads other things than {wanted.__name__}"
    )
    _check_garbage(adapter, golden, read)
    facts = Facts(name, adapter.gives, fps=True, frames=adapter.gives == "video")
    if wanted is not PoseSequence:
        return facts
    if adapter.gives == "poses":
        copies = (
            read(mirrored)
            if mirrored
            else tuple(person.with_(joints=person.joints * [-1, 1, 1]) for person in people)
        )
        _check_guard(adapter, golden, people, copies)
    return _of_people(people, facts)


def _expect(kept: bool, otherwise: str) -> None:
    if not kept:
        raise AssertionError(otherwise)


def _check_alone(adapter: Adapter, golden: Path, by_name: bool) -> None:
    if by_name:
        _expect(not adapter.sniff(golden), "it recognises the file, but should not")
        return
    _expect(adapter.sniff(golden) is True, f"it does not recognise its golden file {golden.name}")
    try:
        chosen = find_adapter(golden).name
    except InputError as error:
        raise AssertionError(str(error)) from None
    _expect(chosen == adapter.name, f"adapter {chosen} takes its golden file")


def _of_people(people: tuple[PoseSequence, ...], facts: Facts) -> Facts:
    frame = people[0].frame
    if facts.gives == "keypoints":
        _expect((frame.axes, frame.unit) == (IMAGE.axes, "px"), f"keypoints are in {frame}, not in {IMAGE}")
    else:
        _expect(frame.family in ("camera", "world"), f"poses are in {frame}, which no source has")
        _expect(frame.unit != "px", "pixels are no unit of 3D poses; call it arbitrary")
    _expect(len({poses.person for poses in people}) == len(people), "two people have the same name")
    scores = np.concatenate([poses.confidence[np.isfinite(poses.confidence)] for poses in people])
    alike = len(scores) > 1 and np.ptp(scores) == 0
    _expect(not alike, "all scores are equal: make them NaN, or give the golden file different ones")
    return replace(
        facts,
        axes=", ".join(frame.axes),
        unit=frame.unit,
        fps=all(poses.time_s is not None for poses in people),
        frames=all(poses.frames_known for poses in people),
        people="one" if len(people) == 1 else "joined" if any(poses.linked for poses in people) else "named",
        scores=len(scores) > 0,
    )


def _check_guard(
    adapter: Adapter, golden: Path, people: tuple[PoseSequence, ...], mirrored: tuple[PoseSequence, ...]
) -> None:
    def guarded(poses: PoseSequence) -> PoseSequence:
        return Source(golden, adapter.name, people, str(golden)).normalised(
            poses, guards=Guards(missing="gap")
        )

    for poses in people:
        try:
            said = [each.text for each in guarded(poses).notices if each.about == "left and right"]
        except InputError as error:
            raise AssertionError(str(error)) from None
        _expect(not said, f"left and right of person {poses.person} are not certain: {' '.join(said)}")
    for poses in mirrored:
        try:
            guarded(poses)
        except InputError:
            continue
        raise AssertionError(
            f"a mirrored person {poses.person} is not refused: the golden file needs 20 frames with bent knees"
        )


def _check_garbage(adapter: Adapter, golden: Path, read: Callable[[Path], Any]) -> None:
    with TemporaryDirectory() as folder:
        for path in (Path(folder), Path(folder) / f"none{golden.suffix}"):
            _expect(_sniffs(adapter, path) is False, f"it recognises {'a' if path.exists() else 'no'} place")
            _expect(not _reads(read, path), "it reads a place where there is nothing")
        for number, (what, content) in enumerate(_GARBAGE.items()):
            path = _rewritten(golden, Path(folder) / str(number), lambda whole, content=content: content)
            _expect(_sniffs(adapter, path) is False, f"it recognises {what}")
            _expect(not _reads(read, path), f"it reads {what}")
        damaged = _rewritten(golden, Path(folder) / "half", lambda whole: whole[: len(whole) // 2])
        _sniffs(adapter, damaged)
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


def _sniffs(adapter: Adapter, path: Path) -> bool:
    try:
        return adapter.sniff(path)
    except Exception as error:
        raise AssertionError(f"sniff raises {error!r}; it must return False") from error


def _reads(read: Callable[[Path], Any], path: Path) -> bool:
    """Whether the file is read; False where an InputError refuses it."""
    try:
        read(path)
    except InputError:
        return False
    except Exception as error:
        raise AssertionError(f"read raises {error!r} where an InputError should say what is wrong") from error
    return True
