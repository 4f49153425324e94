"""What an adapter, a stage, a writer, a model, a rectifier and a lifter must look like.

A module may be an adapter or a writer: it has the attributes.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from ..core.lifted import Lifted, ToLift
from ..core.notices import Notice
from ..core.take import Take


class Adapter(Protocol):
    """Reads one upstream format.

    name: the entry point's name.
    gives: "poses" (3D), "keypoints" (2D), "video" or "imu".
    reads: one line for `pcnet3d list adapters`.
    sniff(path): whether the content looks like this format; cheap, and never raises.
    read(path, **options): a tuple of PoseSequence, one a person (or of Video, or of Imu), in the source's own layout
        and a frame that says its axes; InputError when the file is not what it should be.

    Optional: `made_by`, a pipeline.core.pose.MadeBy, if all of its files are made by the same program or method;
    `lacks(path)`, why it does not take a file that is much like its own, "" for any other; `general`, that it reads
    what many programs write, and steps back where an adapter of one program recognises the file.
    """

    name: str
    gives: str
    reads: str

    def sniff(self, path: Path) -> bool: ...
    def read(self, path: Path) -> tuple[Any, ...]: ...


class Stage(Protocol):
    """One step of a pipeline: a callable whose constructor arguments are its options.

    needs, gives: names of Take fields that must be filled before, and that are filled after.

    Optional, asked before the run's work:
    renews: names of fields that it brings up to date if they are filled, as `scale` does with what was rectified.
    reads: names of the fields of `take.told` that it reads. What the user says and no stage reads is refused.
    check_told(told): InputError if the stage cannot work with what the user says.
    check_rate(fps): InputError if it cannot work at this frame rate.
    check_unit(unit): InputError if it cannot work with poses in this unit: "m", "arbitrary" (no scale), or "" if that
        is not known before the run.
    unit_of(before, told): the unit, in the same words, of the poses that it gives for poses in the unit `before`.
        Without this method the unit of the poses that it gives is not known.
    Optional: together(takes) -> takes, in the same order, for a stage that treats several people of one recording
        together; for a single take it does the same as a call.
    """

    @property
    def name(self) -> str: ...
    @property
    def needs(self) -> tuple[str, ...]: ...
    @property
    def gives(self) -> tuple[str, ...]: ...
    def __call__(self, take: Take) -> Take: ...


class Writer(Protocol):
    """Writes one more file of a run, on `--also NAME`.

    file: its name, or that of a folder, in the run's folder. what: one line for `pcnet3d list writers`.
    write(take, path): writes it, whole or not at all; InputError when the take lacks what the file holds. It may return
        notices: what a user of the file has to know, for summary.json and the report.

    Optional: images: whether its file holds images of the person, which `--no-frames` refuses. metric: whether it holds
    metres, which a take without a scale does not have. bones: whether `write` takes `names`, those of the bones
    (`--set export.names=NAMES`). check(): raises InputError, before the run's work, if something is missing that it
    needs, such as another package.
    """

    @property
    def file(self) -> str: ...
    @property
    def what(self) -> str: ...
    def write(self, take: Take, path: Path) -> Sequence[Notice] | None: ...


class Model(Protocol):
    """A rectifier, lifter, detector or person detector that is asked for by name.

    what: one line for `pcnet3d list models`, which opens nothing.
    open(): an object of the group's protocol (Rectifier and Lifter below, Detector and PersonNetwork in
        models/detector/protocols.py), or the path of an .onnx file of a kind that pcnet3d opens. Raises InputError.
    """

    @property
    def what(self) -> str: ...
    def open(self) -> Any: ...


class Rectifier(Protocol):
    """Gives every frame its rotation.

    rotation(joints): joints (T, 17, 3), H36M17 in CAMERA axes, pelvis at the origin, any scale, NaN where
        missing -> R_camera_from_body (T, 3, 3) and error_deg (T,), NaN where it cannot tell.
    method: how results name it, "geometric", "pcnet@<hash>" or, of a file, "mine.onnx@<hash>".
    """

    @property
    def method(self) -> str: ...
    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...


LIFTER_TAKES = ("images", "gaps", "up", "guessed focal")  # what Lifter.takes may name


class Lifter(Protocol):
    """Turns one person's 2D keypoints, and the images where it looks at them, into 3D poses.

    method: how results name it, "name@<hash>". unit: that of its poses, "m" or "arbitrary", or "" if only its work
        shows it. A run that needs metres and cannot get them is refused before its work.
    takes: what it can use; the rest it is not given. "images": it looks at the video, so its keypoints keep
        the lens's distortion. "gaps": it was trained on missing joints, so joints outside the image and
        frames of somebody else are left out. "up": it lifts a second time if up is known and the first lift does not
        contradict that. "guessed focal": for it a usual phone's focal length is better than none.
    lift(asked): the poses and what was counted. Raises InputError for keypoints that it cannot lift.
    """

    @property
    def method(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def takes(self) -> tuple[str, ...]: ...
    def lift(self, asked: ToLift) -> Lifted: ...
