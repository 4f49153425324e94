"""What a report is asked, and what it judges: whose takes before what cameras, lifted by what; and finished takes with
their truth, in every configuration that a run can have.

A finished take is what `pcnet3d run` leaves before it writes files: the stages of the default recipe, from keypoints of
the test bed on, or of a real video with truth, so that what is judged is what a user gets. Other lifters than the
built-in one are those of other packages and files, or simulated.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.camera import Look
from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import CAMERA
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import MadeBy, package_version
from ....pipeline.core.take import CameraMotion, Take, Told
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.running.progress import each
from ....pipeline.running.recipe import Recipe, load_recipe
from ...angle_error.posture import features, growth
from ...common.metrics import relative
from ...gravity.view import camera_of, known_camera
from ..mocap.clips import Clip, Subjects, data_set, read_clips
from ..synthetic.cameras import ViewRange
from .real_data import real_takes
from .testbed import (
    BEDS,
    MIN_FRAMES,
    Bed,
    LiftedTake,
    SeenTake,
    lifted_takes,
    posed,
    see,
    seen_from,
    simulated_look,
)

_LOOK_EVERY = 10  # frames of a moving camera whose image is asked for up
_ANSWERED = 0.8  # share of them that tells it
_FILES = ("record", "export", "report")  # stages that only write

Sets = Literal["test", "val", "tennis", "cmu"]


@dataclass(frozen=True)
class EvaluationSet:
    """label: its name in tables. subjects: whose clips; of: those of that data set only (clips.data_set)."""

    label: str
    subjects: Subjects
    of: str | None = None

    def clips(self) -> tuple[Clip, ...]:
        """The motion capture of the set; InputError where the data is not, or no take of it is long enough."""
        clips = tuple(clip for clip in read_clips(self.subjects) if self.has(clip))
        if not any(len(clip) >= MIN_FRAMES for clip in clips):
            raise InputError(
                "nothing-usable",
                f"Expected a take of {MIN_FRAMES} frames or more for the set {self.label}, but the motion capture has "
                "none; set PCNET3D_DATA to a folder that has one.",
            )
        return clips

    def has(self, clip: Clip) -> bool:
        return self.of is None or data_set(clip) == self.of


_CMU_TEST = EvaluationSet("CMU test", "test")
# People whom no network was taught by: "test", those that figures are published of, of whom "cmu" is the half that
# anybody may have, and "tennis", others at match pace; "val", those that networks and constants are chosen by.
EVALUATION_SETS: dict[Sets, tuple[EvaluationSet, ...]] = {
    "test": (_CMU_TEST, EvaluationSet("HDM05", "hdm05")),
    "cmu": (_CMU_TEST,),
    "tennis": (EvaluationSet("Tennis test", "tennis"),),
    "val": (
        EvaluationSet("CMU val", "val", of="cmu"),
        EvaluationSet("ACCAD m1", "val", of="accad"),
        EvaluationSet("Tennis val", "val", of="tennis"),
    ),
}


@dataclass(frozen=True)
class Question:
    """What every report is asked. rectifiers: those that are judged. lifter: what lifts (lifter.builtin.lifted).
    seed: of cameras and detectors. people: whose takes, before the cameras of `bed`; None for a report on other data.
    """

    rectifiers: tuple[Rectifier, ...] = ()
    lifter: str | Path = "pcnet3d"
    seed: int = 0
    people: Sets | None = "val"
    bed: Bed = "wild"

    @property
    def sets(self) -> tuple[EvaluationSet, ...]:
        return EVALUATION_SETS[self.people] if self.people else ()

    @property
    def views(self) -> ViewRange:
        return BEDS[self.bed]

    def takes(self, of: EvaluationSet) -> Iterator[LiftedTake]:
        """The set's lifted takes (testbed.lifted_takes), counted on the screen."""
        takes = lifted_takes(of.subjects, self.seed, model=self.lifter, views=self.views, only=of.has)
        yield from each(takes, f"{of.label} takes", len(of.clips()))

    def how(self, **changes: Any) -> Configuration:
        """A run by the lifter that is judged, before the cameras of `bed`. changes: as Configuration has them."""
        return Configuration(lifter=str(self.lifter), bed=self.bed, **changes)

    def heading(self) -> dict[str, Any]:
        """What reports say first: versions and settings; the seed and the cameras of those that have them."""
        said = {"pcnet3d": package_version(), "lifter": str(self.lifter)}
        return said | ({"seed": self.seed, "bed": self.bed} if self.people else {})


@dataclass(frozen=True)
class Configuration:
    """What a run can have. image: an image tells up, as well as rendered rooms do (testbed.simulated_look).
    up_told: the user tells it. lifter: of load_lifter, or "" for the captured joints themselves, measured. bed: the
    cameras; camera: whether they stand still or follow the person. fps: frames a second. focal_known: by the user; else
    the usual one is assumed, as of a video without lines. side: of VIEWS, from which people who do not turn are
    filmed. real: the name of a take before four real cameras (real_data.py), in place of virtual takes; then the image
    is the video's own. errors: a file of angles' errors, as a user gives one. unsuspected: how many times as much the
    detector errs in unusual postures and fast motion, and its scores do not tell (`unsuspected`). pose: of
    testbed.POSES, that bodies are put in."""

    image: bool = False
    camera: CameraMotion = "static"
    up_told: bool = False
    lifter: str = "pcnet3d"
    bed: Bed = "wild"
    fps: float = 30.0
    focal_known: bool = False
    side: str = ""
    real: str = ""
    errors: Path | None = None
    unsuspected: float = 1.0
    pose: str = ""


@dataclass(frozen=True, eq=False)
class Finished:
    """One take. take: as a run leaves it, or None where it ends with `reason`. truth: what is true of it. label: of the
    set."""

    take: Take | None
    truth: SeenTake
    label: str
    reason: str = ""
    configuration: Configuration = Configuration()

    def captured(self) -> Take:
        """The captured joints after the same stages, up told: what the take's figures are in truth. InputError for a
        camera that moves, whose up nobody can tell."""
        true = replace(self.configuration, lifter="", up_told=True, image=False, errors=None)
        return recipe_of(true).build()(given(self.truth, 0, true))


def finished(
    question: Question,
    configuration: Configuration,
    sets: Sequence[EvaluationSet] | None = None,
    only: Callable[[Clip], bool] = lambda clip: True,
) -> Iterator[Finished]:
    """Every take of the question's sets, or of those given, of at least MIN_FRAMES frames, after a run in that
    configuration; only: which of them. The cameras and the detector depend on the seed and the clip only. InputError
    where the data is not, and for a lifter that cannot be opened; a take that a run refuses is given with the reason.
    """
    pipeline = recipe_of(configuration).build()
    sets = question.sets if sets is None else sets
    takes = (
        _real(question, configuration)
        if configuration.real
        else _virtual(question, configuration, sets, only)
    )
    for label, truth, asked in takes:
        take, reason = None, ""
        try:
            take = pipeline(asked)
        except InputError as error:
            reason = str(error)
        yield Finished(take, truth, label, reason, configuration)


def _virtual(
    question: Question,
    configuration: Configuration,
    sets: Sequence[EvaluationSet],
    only: Callable[[Clip], bool],
) -> Iterator[tuple[str, SeenTake, Take]]:
    usual = replace(BEDS[configuration.bed], pans=float(configuration.camera == "moving"))
    for of in sets:
        clips = [clip for clip in of.clips() if len(clip) >= MIN_FRAMES and only(clip)]
        for clip in each(clips, of.label, len(clips)):
            views = seen_from(clip, configuration.side, usual) if configuration.side else usual
            if views is None:
                continue
            moving = posed(at_rate(clip, configuration.fps), configuration.pose, question.seed)
            truth = see(moving, question.seed, views=views)
            truth = unsuspected(truth, configuration.unsuspected)
            yield of.label, truth, given(truth, question.seed, configuration)


def unsuspected(truth: SeenTake, times: float) -> SeenTake:
    """The take as seen by a detector whose errors are up to so many times as large in unusual postures and fast motion,
    with the same scores: MoveNet's of a man who balances before four cameras are 1.9 to 4.7 % of his box, those of the
    test bed 1.9 (real_data.py, docs/research.md)."""
    if times == 1:
        return truth
    at, seen = truth.joints_camera, truth.keypoints
    exact = truth.focal_px * at[..., :2] / at[..., 2:] + np.array(truth.image_size) / 2
    unusual = growth(features(relative(truth.world), seen.times)).max(axis=1).clip(0, 1)
    joints = exact + (1 + (times - 1) * unusual)[:, None, None] * (seen.joints - exact)
    return replace(truth, keypoints=seen.with_(joints=joints))


def _real(question: Question, configuration: Configuration) -> Iterator[tuple[str, SeenTake, Take]]:
    for video, truth in real_takes(configuration.real):
        asked = given(truth, question.seed, replace(configuration, image=False)).with_(video=video)
        if configuration.image:
            rows = int(truth.keypoints.frame_index[0]), int(truth.keypoints.frame_index[-1])
            asked = asked.with_(camera=camera_of(video, truth.keypoints, rows))
        yield "real take", truth, asked


def at_rate(clip: Clip, fps: float) -> Clip:
    """The clip at another rate, along cubic splines through the captured joints."""
    if abs(clip.fps - fps) < 1e-6:
        return clip
    from scipy.interpolate import CubicSpline

    captured = np.arange(len(clip)) / clip.fps
    frames = int(captured[-1] * fps + 1e-6) + 1
    joints = CubicSpline(captured, clip.joints.astype(np.float64))(np.arange(frames) / fps)
    return replace(clip, fps=fps, joints=joints.astype(np.float32))


def recipe_of(configuration: Configuration) -> Recipe:
    """The default recipe as that configuration has it, from keypoints on or from poses, without files."""
    recipe = load_recipe()
    for stage in _FILES:
        recipe = recipe.without(stage)
    if configuration.errors is not None:
        recipe = recipe.with_options("angles", errors=configuration.errors)
    if not configuration.lifter:
        return recipe
    return recipe.starting_with("lift").with_options("lift", lifter=configuration.lifter)


def given(truth: SeenTake, seed: int, configuration: Configuration) -> Take:
    """What a run is given: keypoints, camera and what the user tells, his stature too; or the captured joints."""
    stature_m = implied_stature(truth.truth)
    told = Told(
        camera=configuration.camera,
        focal_px=truth.focal_px if configuration.focal_known else None,
        gravity=tuple((-truth.up).tolist()) if configuration.up_told else None,  # type: ignore[arg-type]
        image_size=truth.image_size,
        stature_m=stature_m if np.isfinite(stature_m) else None,
    )
    camera = known_camera(truth.image_size, told.focal_px, None)
    if configuration.image:
        camera = replace(camera, looks=looks(truth, seed))
    take = Take(truth.clip, keypoints=truth.keypoints, camera=camera, told=told)
    if configuration.lifter:
        return take
    frame = CAMERA.with_(origin="pelvis")
    return take.with_(
        poses=truth.keypoints.with_(
            joints=truth.truth,
            layout=H36M17,
            frame=frame,
            confidence=None,
            made_by=MadeBy("measured", "motion capture"),
        )
    )


def looks(truth: SeenTake, seed: int) -> tuple[Look, ...]:
    """What images say about up: one for a camera that stands still; of one that moves every tenth frame is asked, and
    four in five answer."""
    if truth.up.ndim == 1:
        return (simulated_look(truth.up, seed, truth.clip),)
    frames = range(0, len(truth.up), _LOOK_EVERY)
    rng = np.random.default_rng([seed, zlib.crc32(truth.clip.encode()), 2])
    answered = rng.uniform(size=len(frames)) < _ANSWERED
    return tuple(
        replace(simulated_look(truth.up[frame], seed, f"{truth.clip} {frame}"), frame=frame)
        for frame, answers in zip(frames, answered, strict=True)
        if answers
    )
