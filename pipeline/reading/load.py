"""Files in, checked pose sequences out: find the adapter, read, choose the person, normalise, guard left and right."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..core.conversions import body_in, change_frame, remap
from ..core.errors import InputError
from ..core.frames import CAMERA
from ..core.layouts import layout_named
from ..core.messages import how_many
from ..core.notices import notice
from ..core.pose import UNSAID, PoseSequence, Step, package_version
from ..core.take import SILENT, Check, Handedness, Told, Video
from ..files.atomic import printable
from ..plugins.options import call, option_types
from ..plugins.protocols import Adapter
from ..signals.checks import empty_rows, whole_rows
from .bounds import check_size, check_times, timed
from .choose import choose_person
from .find import Gives, adapters, exchanged, find_adapter, recognises, why_no_input
from .guard import guarded
from .joint_order import check_order


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
        """One of the people, as read_all gives them: 2D as it is; 3D in our joints and axes, relative to the pelvis,
        guarded. told: its handedness and check count. Raises InputError."""
        poses = person
        if not self.digest:
            options = {"adapter": self.adapter, "file": printable(self.path.name), "person": person.person}
            poses = poses.with_(history=(Step("read", package_version(), options), *poses.history))
        poses = poses if fps is None else timed(poses, fps)
        check_size(poses, self.where)
        if poses.frame.dims == 2:
            return poses
        poses = _missing(poses, self.where)
        poses = remap(poses, body_in(poses))
        own = CAMERA if poses.frame.family == "camera" else poses.frame
        unit = "m" if poses.frame.metric else poses.frame.unit
        poses = change_frame(poses, own.with_(origin="pelvis", unit=unit))
        return guarded(poses, told.handedness, self.where, told.check)


def _missing(poses: PoseSequence, where: str) -> PoseSequence:
    """Frames with NaN, and those of zeros as gaps, counted. InputError where no frame has a pose."""
    empty = empty_rows(poses)
    gone = ~whole_rows(poses) & ~empty
    if empty.all() or np.isnan(poses.joints).all():
        raise InputError(
            "nothing-usable",
            f"{where}: in each of {how_many(len(poses), 'frame')} all joints are NaN or at one point; there are no "
            "poses in it.",
        )
    if not (empty | gone).any():
        return poses
    counts = {"frames with NaN": int(gone.sum()), "frames with all joints at one point": int(empty.sum())}
    counted = ", ".join(
        how_many(count, what.replace("frames", "frame", 1), what) for what, count in counts.items() if count
    )
    poses = poses.with_(joints=np.where(empty[:, None, None], np.nan, poses.joints))
    return poses.noted("missing", **counts).saying(notice("frames-as-gaps", counts=counted))


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
    source, told = load(Path(path), adapter, gives, options), Told(handedness=handedness, check=check)
    return tuple(_clocked(source, person, fps, told) for person in source.people)


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
    source, told = load(Path(path), adapter, gives, options), Told(handedness=handedness, check=check)
    return _clocked(source, choose_person(source.people, person, str(path)), fps, told)


def _clocked(source: Source, person: PoseSequence, fps: float | None, told: Told) -> PoseSequence:
    """One of the people, `normalised`; InputError for times that no recording has."""
    poses = source.normalised(person, fps, told)
    if poses.time_s is not None:
        check_times(poses.time_s, str(source.path))
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
        people = _people(chosen, path, options, image_size)
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


def _people(
    adapter: Adapter, path: Path, options: dict[str, Any], image_size: tuple[int, int] | None
) -> tuple[PoseSequence, ...]:
    """Everybody whom an adapter reads, 2D keypoints in the order of joints that is said, or that their bones show to be
    right. InputError for nobody, and for anything but people."""
    takes, own = option_types(adapter.read), dict(options)
    layout = own.pop("layout", None) if adapter.gives == "keypoints" and "layout" not in takes else None
    if "image_size" in takes and image_size is not None:
        own.setdefault("image_size", image_size)
    people: Any = call(adapter.read, path, what=f"Adapter '{adapter.name}'", options=own)
    if not isinstance(people, tuple | list) or {type(person) for person in people} != {PoseSequence}:
        raise InputError(
            "plugin-broken",
            f"Expected a tuple of people (PoseSequence) from adapter '{adapter.name}', got {people!r:.60}; repair its "
            "package (docs/python.md), or name another adapter.",
        )
    made_by = getattr(adapter, "made_by", UNSAID)
    people = tuple(each.with_(made_by=made_by) if each.made_by == UNSAID else each for each in people)
    usual = people[0].layout
    if adapter.gives == "poses":
        return people
    if layout is not None:
        said = layout_named(layout)
        if len(said) != len(usual):
            raise InputError(
                "bad-value",
                f"Expected a layout of {how_many(len(usual), 'joint')}, as the file has, got {layout}.",
            )
        return tuple(each.with_(layout=said) for each in people)
    points = np.concatenate([each.joints for each in people])
    way_out = (
        f"--set keypoints.layout={{0}} (-O layout={{0}}), and with layout={usual.name} that they are not"
    )
    check_order(points, usual, "", way_out)
    return people


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
