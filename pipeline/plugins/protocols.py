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

    It may have `made_by`, a pipeline.core.pose.MadeBy: who made the poses, where that is the same for all of its files.
    """

    name: str
    gives: str
    reads: str

    def sniff(self, path: Path) -> bool: ...
    def read(self, path: Path) -> tuple[Any, ...]: ...


class Stage(Protocol):
    """One step of a pipeline: a callable whose constructor arguments are its options.

    needs, gives: names of Take fields that must be filled before, and that are filled after.

    What else it may have, which is asked before any of the run's work is done:
    renews: names of fields that it brings up to date where they are filled, as a scale does with what was rectified.
    reads: names of the fields of `take.told` that it reads: what nobody reads is refused when it is told.
    check_told(told): InputError where what the user tells will not do.
    check_rate(fps): InputError where so many frames a second will not do.
    check_unit(unit): InputError where poses in this unit will not do, "m", "arbitrary" (no scale), or "" where that is
        not known before it runs.
    unit_of(before, told): the unit, in the same words, of the poses that it gives, of poses that come to it in the unit
        `before`. Without it that of a stage that gives poses is not known.
    And together(takes) -> takes, of a stage that has more to say about several people of one recording than about each
        alone: in the order given; what it does to one take it does to each.
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

    What else it may have: images, whether its file holds images of the person, which `--no-frames` refuses; metric,
    whether it holds metres, which a take without a scale does not have; check(), an InputError before any of the run's
    work is done where something that it needs is lacking, such as another package.
    """

    @property
    def file(self) -> str: ...
    @property
    def what(self) -> str: ...
    def write(self, take: Take, path: Path) -> Sequence[Notice] | None: ...


class Model(Protocol):
    """A rectifier, lifter, detector, person detector or gravity network that is asked for by name.

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
    method: how results name it, "geometric" or "pcnet@<hash>".
    """

    @property
    def method(self) -> str: ...
    def rotation(self, joints: np.ndarray) -> tuple[np.ndarray, np.ndarray]: ...


LIFTER_TAKES = ("images", "gaps", "up", "guessed focal")  # what Lifter.takes may name


class Lifter(Protocol):
    """Turns one person's 2D keypoints, and the images where it looks at them, into 3D poses.

    method: how results name it, "name@<hash>". unit: of its poses, "m" or "arbitrary", "" where only its work tells: a
        run that needs metres and will have none is refused before its work.
    takes: what it can make use of, and else is not given. "images": it looks at the video, so that its keypoints keep
        the lens's distortion. "gaps": it was trained on missing joints, so that those that the image cannot show, and
        frames of somebody else, are left out. "up": it lifts again where up is known and the first lift does not
        contradict that. "guessed focal": a focal length that phones usually have is better for it than none.
    lift(asked): the poses and what is to be said of them. Raises InputError for keypoints that it cannot lift.
    """

    @property
    def method(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def takes(self) -> tuple[str, ...]: ...
    def lift(self, asked: ToLift) -> Lifted: ...
