"""Files in, checked pose sequences out: find the adapter, read, choose the person, normalise, guard left and right."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, get_args

from ..core.errors import InputError
from ..core.pose import UNSAID, PoseSequence
from ..core.take import Handedness, Video
from ..plugins.options import call
from ..plugins.protocols import Adapter
from .choose import choose_person
from .describe import why_no_input
from .find import Gives, adapters, exchanged, find_adapter, recognises
from .normalise import Missing, normalised


@dataclass(frozen=True, eq=False)
class Source:
    """A file or folder, its adapter, and everybody in it as the adapter gives them: in its own layout and frame."""

    path: Path
    adapter: Adapter
    people: tuple[PoseSequence, ...]

    def normalised(
        self,
        person: PoseSequence,
        fps: float | None = None,
        handedness: Handedness = "refuse",
        missing: Missing = "refuse",
    ) -> PoseSequence:
        """One of the people, as read_all gives them."""
        return normalised(person, self.adapter, self.path, fps, handedness, missing)


def read_all(
    path: str | Path,
    adapter: str = "auto",
    *,
    gives: Literal["poses", "keypoints"] | None = None,
    fps: float | None = None,
    handedness: Handedness = "refuse",
    missing: Missing = "refuse",
    **options: Any,
) -> tuple[PoseSequence, ...]:
    """Every person in a file.

    adapter: a registered name, or "auto" to recognise the file by its content.
    gives: read only as "poses" (3D) or only as "keypoints" (2D).
    fps: frame rate, for files that do not know theirs.
    handedness: what to do when left and right contradict nose and knees: "refuse", "mirror" the coordinates,
        "swap" the names, "swap-legs" only, or "ignore".
    missing: what to do with 3D frames that are NaN or all zero: "refuse", or take them for a "gap".
    options: the adapter's own.

    3D comes back as H36M17 in CAMERA axes (or in the source's own frame, when that is no camera's) relative
    to the pelvis, whose own way is `root` where the source knows it; 2D in IMAGE, in the detector's layout. Raises
    InputError.
    """
    check_guards(handedness, missing)
    source = load(Path(path), adapter, gives, options)
    return tuple(source.normalised(person, fps, handedness, missing) for person in source.people)


def read(
    path: str | Path,
    adapter: str = "auto",
    person: str | None = None,
    *,
    gives: Literal["poses", "keypoints"] | None = None,
    fps: float | None = None,
    handedness: Handedness = "refuse",
    missing: Missing = "refuse",
    **options: Any,
) -> PoseSequence:
    """One person from a file: by the file's own name, "longest", "largest" (see choose_person), or the only one.

    Other arguments are those of read_all. What is wrong with the others does not matter. InputError when there are
    several and none is named.
    """
    check_guards(handedness, missing)
    source = load(Path(path), adapter, gives, options)
    return source.normalised(choose_person(source.people, person, str(path)), fps, handedness, missing)


def load(path: Path, adapter: str, gives: Gives | None, options: dict[str, Any]) -> Source:
    """What is in a file, read by the adapter of that name, or with "auto" by the only one that recognises it.
    InputError as for read_all."""
    chosen = find_adapter(path, adapter, gives)
    if chosen.gives not in ("poses", "keypoints"):
        raise InputError(
            "format-unknown", f"{path} is a file of {chosen.gives}; expected one of poses or keypoints."
        )
    try:
        people = _people(chosen, call(chosen.read, path, what=f"Adapter '{chosen.name}'", options=options))
        maker = getattr(chosen, "made_by", UNSAID)
        return Source(
            path, chosen, tuple(one.with_(made_by=maker) if one.made_by == UNSAID else one for one in people)
        )
    except InputError as error:
        said = str(error) if str(path) in str(error) else f"{path}: {error}"
        others = [other for other in adapters().values() if other is not chosen and recognises(other, path)]
        alike = [other.name for other in others if gives in (None, other.gives)]
        if adapter != "auto" and alike:
            said += f" It looks like a file for adapter {' or '.join(alike)}."
        elif adapter != "auto" and others:
            said += f" {exchanged(path, gives)}"
        raise InputError(error.code, said) from None


def _people(adapter: Adapter, given: Any) -> tuple[PoseSequence, ...]:
    """What an adapter read; InputError for nobody, and for anything but people."""
    several = isinstance(given, tuple | list)
    if several and given and all(isinstance(one, PoseSequence) for one in given):
        return tuple(given)
    got = sorted({type(one).__name__ for one in given}) if several else [type(given).__name__]
    raise InputError(
        "plugin-broken",
        f"Expected a tuple of people (PoseSequence) from adapter '{adapter.name}', got {', '.join(got) or 'nobody'}; "
        "repair its package (docs/python.md), or name another adapter.",
    )


def read_video(path: Path) -> Video:
    """The video's description; InputError when it cannot be opened."""
    adapter = find_adapter(path, "video", "video")
    if not recognises(adapter, path) and (why := exchanged(path, "video") or why_no_input(path, "video")):
        raise InputError("format-unknown", why)
    if path.is_dir():
        raise InputError("cannot-open", f"Expected a video file at {path}, found a folder there.")
    return call(adapter.read, path, what="Adapter 'video'", options={})[0]


def check_guards(handedness: str, missing: str) -> None:
    """InputError for a guard that there is not."""
    for name, value, allowed in (
        ("handedness", handedness, get_args(Handedness)),
        ("missing", missing, get_args(Missing)),
    ):
        if value not in allowed:
            raise InputError(
                "bad-value", f"Expected {name} to be one of {', '.join(allowed)}; got '{value}'."
            )
