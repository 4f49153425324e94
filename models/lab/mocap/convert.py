"""Motion capture of several formats into the one file that training and evaluation read:

pcnet3d lab mocap FOLDER -o clips.npz
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from typer import Argument, Option

from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many, say, show
from ....pipeline.files.skeletons import UNITS
from ....pipeline.plugins.options import did_you_mean
from ....pipeline.reading.mocap import Clip, upright_share
from ....pipeline.running.progress import each
from . import asfamc as mocap_asfamc
from . import mmfi as mocap_mmfi
from .files import BVH_FILES, JOINTS_FILES, Found, How, bvh_clip, joints_clip, write_mocap


def check_upright(clips: Sequence[Clip]) -> None:
    """InputError when most frames have the head no higher than the feet: then up is another axis."""
    share = upright_share(np.concatenate([clip.joints for clip in clips]))
    if share < 0.5:
        raise InputError(
            "wrong-axes",
            f"Only in {100 * share:.0f} % of the frames is the head above the feet; say which axis is up with --up.",
        )


@dataclass(frozen=True)
class Format:
    """files_are: in words. pattern: of the files in the folder, or one below it unless it starts with **. fps: of the
    clips written. check: of all clips together; InputError when they are not what the format says."""

    files_are: str
    read: Callable[[Path, Path, How], Found]
    pattern: str
    fps: float = 30.0
    check: Callable[[Sequence[Clip]], None] = check_upright

    def files(self, folder: Path) -> list[Path]:
        if folder.is_file():
            return [folder] if Path(folder.name).match(self.pattern.removeprefix("**/")) else []
        if self.pattern.startswith("**"):
            return sorted(folder.glob(self.pattern))
        return sorted({*folder.glob(self.pattern), *folder.glob(f"*/{self.pattern}")})


FORMATS = {
    "mmfi": Format(
        "E01/S01/A01/ground_truth.npy", mocap_mmfi.read, mocap_mmfi.PATTERN, mocap_mmfi.FPS, mocap_mmfi.check
    ),
    "asfamc": Format(".amc", mocap_asfamc.read, mocap_asfamc.PATTERN),
    "bvh": Format(".bvh", bvh_clip, BVH_FILES),
    "joints": Format(".npz", joints_clip, JOINTS_FILES),
}
# The first that fits. MM-Fi comes before anything is searched through, for it has millions of files beside the joints;
# .npz files lie beside other data as well, such as the one that this command writes.
_ORDER = (("mmfi",), ("asfamc", "bvh"), ("joints",))


def mocap(
    folder: Annotated[Path, Argument(help="Motion capture: MM-Fi, ASF/AMC, BVH, or .npz with joints.")],
    output: Annotated[Path, Option("-o", "--output", help="The .npz file to write.")],
    format: Annotated[str, Option(help=f"Format of the files: auto, {', '.join(FORMATS)}.")] = "auto",
    unit: Annotated[str | None, Option(help=f"Unit of the files: {', '.join(UNITS)}.")] = None,
    up: Annotated[Literal["y", "z"] | None, Option(help="The files' vertical axis.")] = None,
    fps: Annotated[float | None, Option(help="Frames per second, where the files say none.")] = None,
    subject: Annotated[str | None, Option(help="Regular expression on the path; group 1 is who.")] = None,
) -> None:
    """Convert a folder of motion capture for training and evaluation.

    It lists the subjects: a split needs to know them.
    """
    if unit is not None and unit not in UNITS:
        raise InputError("bad-value", f"Expected a unit of {', '.join(UNITS)}; got '{unit}'.")
    if fps is not None and not fps > 0:
        raise InputError("bad-value", f"Expected a positive frame rate, got {fps}.")
    clips, notes = read_folder(folder, format, How(unit, up, fps, subject))
    write_mocap(output, clips)
    for note in notes:
        say("note", note)
    frames = sum(map(len, clips))
    people = Counter(clip.subject for clip in clips)
    minutes = frames / clips[0].fps / 60
    show(f"{output}: {how_many(len(clips), 'clip')}, {frames:,} frames, {minutes:.1f} min")
    print(
        f"{how_many(len(people), 'subject')} (clips): {', '.join(f'{who} ({n})' for who, n in sorted(people.items()))}"
    )


def read_folder(
    folder: Path,
    format: str = "auto",
    how: How | None = None,
    only: Callable[[Path], bool] = lambda file: True,
) -> tuple[list[Clip], list[str]]:
    """The clips of a folder (or one file) at the format's frame rate, and one sentence for everything that was assumed
    or left out. only: which of its files. InputError when the format is unknown or not clear, or nothing could be read.
    """
    if not folder.exists():
        raise InputError(
            "cannot-open", f"Expected a folder of motion capture at {folder}, found nothing there."
        )
    name, files = _recognised(folder, format)
    files = [file for file in files if only(file)]
    read, notes, bad, clips = FORMATS[name], Counter(), [], {}
    for file in each(files, "files", len(files)):
        try:
            found = read.read(file, folder if folder.is_dir() else folder.parent, how or How())
            if found.clip.name in clips:
                raise InputError("wrong-content", f"there is another clip named {found.clip.name}.")
            clip = resampled(found.clip, read.fps)
        except InputError as error:
            bad.append(f"{file}: {error}")
            continue
        clips[clip.name] = clip
        notes.update(found.notes)
    if not clips:
        raise InputError(
            "format-unknown",
            f"No file of {len(files)} in {folder} could be read as {name}"
            + (f"; the first is {bad[0]}" if bad else ", none is of the people that are asked for."),
        )
    read.check(list(clips.values()))
    said = [f"{note} ({count} of {how_many(len(files), 'file')})" for note, count in notes.items()]
    if format == "auto" and name in ("asfamc", "bvh") and (beside := FORMATS["joints"].files(folder)):
        said.append(
            f"{how_many(len(beside), '.npz file')} beside them not read; --format joints reads these alone"
        )
    return list(clips.values()), said + [f"left out {sentence}" for sentence in bad]


def resampled(clip: Clip, fps: float) -> Clip:
    """The clip at another frame rate: every n-th frame where n is whole, otherwise straight lines between frames.
    Nothing is filtered, as in the motion capture that the shipped networks were trained on."""
    ratio = clip.fps / fps
    if abs(ratio - round(ratio)) < 1e-3 * ratio and ratio > 0.5:
        return replace(clip, fps=fps, joints=clip.joints[:: round(ratio)])
    at = np.arange(int((len(clip) - 1) / ratio + 1e-6) + 1) * ratio
    before = np.minimum(at.astype(int), max(len(clip) - 2, 0))
    share = (at - before)[:, None, None]
    after = np.minimum(before + 1, len(clip) - 1)
    joints = (1 - share) * clip.joints[before] + share * clip.joints[after]
    return replace(clip, fps=fps, joints=joints.astype(np.float32))


def _recognised(folder: Path, format: str) -> tuple[str, list[Path]]:
    if format != "auto" and format not in FORMATS:
        raise InputError("name-unknown", f"There is no format '{format}'; {did_you_mean(format, FORMATS)}")
    for names in _ORDER if format == "auto" else ((format,),):
        found = {name: files for name in names if (files := FORMATS[name].files(folder))}
        if len(found) > 1:
            raise InputError(
                "format-ambiguous", f"{folder} holds files of {' and '.join(found)}; say which with --format."
            )
        if found:
            return next(iter(found.items()))
    wanted = FORMATS if format == "auto" else (format,)
    kinds = ", ".join(FORMATS[name].files_are for name in wanted)
    raise InputError("nothing-usable", f"Expected motion capture ({kinds}) in {folder}, found none.")
