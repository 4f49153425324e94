"""Files in, checked pose sequences out: find the adapter, read, choose the person, normalise, guard left and right."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..core.errors import InputError
from ..core.layouts import layout_named
from ..core.messages import how_many
from ..core.pose import UNSAID, PoseSequence, Step, package_version
from ..core.take import SILENT, Check, Handedness, Told, Video
from ..files.atomic import printable
from ..plugins.options import call, option_types
from ..plugins.protocols import Adapter
from .bounds import check_times
from .choose import choose_person
from .find import Gives, adapters, exchanged, find_adapter, recognises, why_no_input
from .joint_order import check_order
from .normalise import normalised


@dataclass(frozen=True, eq=False)
class Source:
    """A file or folder, the name of its adapter, and everybody in it as the adapter gives them: in its own layout and
    frame. where: what it is, for errors. digest: SHA-256 of what was given in memory (reading/given.py)."""

    path: Path
    adapter: str
    people: tuple[PoseSequence, ...]
    where: str
    digest: str = ""

    def normalised(self, person: PoseSequence, fps: float | None = None, told: Told = SILENT) -> PoseSequence:
        """One of the people, as read_all gives them."""
        if not self.digest:
            options = {"adapter": self.adapter, "file": printable(self.path.name), "person": person.person}
            step = Step("read", package_version(), options)
            person = person.with_(history=(step, *person.history))
        return normalised(person, self.where, fps, told)


def read_all(
    path: str | Path,
    adapter: str = "auto",
    *,
    gives: Literal["poses", "keypoints"] | None = None,
    fps: float | None = None,
    handedness: Handedness = "refuse",
    check: Check = "refuse",
    **options: Any,
) -> tuple[PoseSequence, ...]:
    """Every person in a file.

    adapter: a registered name, or "auto" to recognise the file by its content.
    gives: read only as "poses" (3D) or only as "keypoints" (2D).
    fps: frame rate, for files that do not know theirs.
    handedness: what to do when left and right contradict nose and knees: "refuse", "mirror" the coordinates,
        "swap" the names, "swap-legs" only, or "ignore".
    check: "off" reads a body that is mirrored or upside down as it is.
    options: the adapter's own.

    3D comes back as H36M17 in CAMERA axes (or in the source's own frame, when that is no camera's) relative
    to the pelvis, whose own way is `root` where the source knows it; 2D in IMAGE, in the detector's layout. Raises
    InputError.
    """
    told = Told(handedness=handedness, check=check)
    source = load(Path(path), adapter, gives, options)
    return tuple(_clocked(source.normalised(person, fps, told), path) for person in source.people)


def read(
    path: str | Path,
    adapter: str = "auto",
    person: str | None = None,
    *,
    gives: Literal["poses", "keypoints"] | None = None,
    fps: float | None = None,
    handedness: Handedness = "refuse",
    check: Check = "refuse",
    **options: Any,
) -> PoseSequence:
    """One person from a file: by the file's own name, "longest", "largest" (see choose_person), or the only one.

    Other arguments are those of read_all. What is wrong with the others does not matter. InputError when there are
    several and none is named.
    """
    told = Told(handedness=handedness, check=check)
    source = load(Path(path), adapter, gives, options)
    chosen = choose_person(source.people, person, str(path))
    return _clocked(source.normalised(chosen, fps, told), path)


def _clocked(poses: PoseSequence, path: str | Path) -> PoseSequence:
    """The poses; InputError for times that no recording has."""
    if poses.time_s is not None:
        check_times(poses.time_s, str(path))
    return poses


def load(
    path: Path,
    adapter: str,
    gives: Gives | None,
    options: dict[str, Any],
    image_size: tuple[int, int] | None = None,
) -> Source:
    """What is in a file, read by the adapter of that name, or with "auto" by the only one that recognises it.

    options: the adapter's own, and for any 2D keypoints `layout`, the order of their joints if it is not the one that
    the format has. image_size: of the video, or as told, for an adapter that needs it. InputError as for read_all, and
    for 2D joints whose bones are those of a body in another order only.
    """
    chosen = find_adapter(path, adapter, gives)
    if chosen.gives not in ("poses", "keypoints"):
        raise InputError(
            "format-unknown", f"{path} is a file of {chosen.gives}; expected one of poses or keypoints."
        )
    try:
        takes, own = option_types(chosen.read), dict(options)
        layout = own.pop("layout", None) if chosen.gives == "keypoints" and "layout" not in takes else None
        if "image_size" in takes and image_size is not None:
            own.setdefault("image_size", image_size)
        people = _people(chosen, call(chosen.read, path, what=f"Adapter '{chosen.name}'", options=own))
        if chosen.gives == "keypoints":
            people = _in_order(people, layout)
        maker = getattr(chosen, "made_by", UNSAID)
        people = tuple(
            person.with_(made_by=maker) if person.made_by == UNSAID else person for person in people
        )
        where = str(path) if chosen.gives == "keypoints" else f"{path} (adapter {chosen.name})"
        return Source(path, chosen.name, people, where)
    except InputError as error:
        sentence = str(error) if str(path) in str(error) else f"{path}: {error}"
        others = [other for other in adapters().values() if other is not chosen and recognises(other, path)]
        alike = [other.name for other in others if gives in (None, other.gives)]
        if adapter != "auto" and alike:
            sentence += f" It looks like a file for adapter {' or '.join(alike)}."
        elif adapter != "auto" and others:
            sentence += f" {exchanged(path, gives)}"
        raise InputError(error.code, sentence) from None


def _in_order(people: tuple[PoseSequence, ...], name: str | None) -> tuple[PoseSequence, ...]:
    """2D keypoints in the layout of that name. InputError for one of another number of joints, and without one where
    the bones are those of a body in another order only."""
    own = people[0].layout
    if name is not None:
        layout = layout_named(name)
        if len(layout) != len(own):
            raise InputError(
                "bad-value",
                f"Expected a layout of {how_many(len(own), 'joint')}, as the file has, got {layout.name} of "
                f"{len(layout)}.",
            )
        return tuple(poses.with_(layout=layout) for poses in people)
    points = np.concatenate([poses.joints for poses in people])
    way_out = f"--set keypoints.layout={{0}} (-O layout={{0}}), and with layout={own.name} that they are not"
    check_order(points, own, "", way_out)
    return people


def _people(adapter: Adapter, given: Any) -> tuple[PoseSequence, ...]:
    """What an adapter read; InputError for nobody, and for anything but people."""
    several = isinstance(given, tuple | list)
    if several and given and all(isinstance(person, PoseSequence) for person in given):
        return tuple(given)
    got = sorted({type(person).__name__ for person in given}) if several else [type(given).__name__]
    raise InputError(
        "plugin-broken",
        f"Expected a tuple of people (PoseSequence) from adapter '{adapter.name}', got {', '.join(got) or 'nobody'}; "
        "repair its package (docs/python.md), or name another adapter.",
    )


def read_video(path: Path) -> Video:
    """The video's description. InputError when it cannot be opened."""
    adapter = find_adapter(path, "video", "video")
    if not recognises(adapter, path) and (why := exchanged(path, "video") or why_no_input(path, "video")):
        raise InputError("format-unknown", why)
    if path.is_dir():
        raise InputError(
            "cannot-open",
            f"Expected a video file at {path}, found a folder there; of images make a video first (ffmpeg -framerate "
            "FPS -pattern_type glob -i 'FOLDER/*.png' video.mp4).",
        )
    return call(adapter.read, path, what="Adapter 'video'", options={})[0]
