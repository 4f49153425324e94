"""What a report is asked and a run can have, and finished takes with their truth.

A finished take is what `pcnet3d run` leaves before it writes files: the stages of the default recipe, from keypoints of
the test bed on, or of a real video with truth, so that what is judged is what a user gets. Other lifters than the
built-in one are those of other packages and files, or simulated.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.camera import Look
from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import CAMERA
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.measures import SD_90
from ....pipeline.core.pose import MadeBy, PoseSequence
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.core.take import CameraMotion, Take, Told, Video
from ....pipeline.plugins.protocols import Rectifier
from ....pipeline.running.progress import each
from ....pipeline.running.recipe import Recipe, load_recipe
from ...angle_error.posture import features, growth, posture
from ...angle_error.take_angles import AngleSeries, TakeJoints, smoothed, take_angles
from ...common.metrics import relative
from ...gravity.view import camera_of, known_camera
from ...lifter.builtin import OwnLifter, network
from ...lifter.load import load_lifter
from ..common.cases import Cases
from ..mocap.clips import Clip, Subjects, data_set, read_clips
from ..synthetic.bodies import BodyRange
from .testbed import (
    BEDS,
    MIN_FRAMES,
    Bed,
    LiftedTake,
    SeenTake,
    laid_down,
    lifted_by,
    real_takes,
    see,
    seen_from,
    simulated_look,
)

_LOOK_EVERY = 10  # frames of a moving camera whose image is asked for up
_ANSWERED = 0.8  # share of them that tells it
_FILES = ("record", "export", "report")  # stages that only write
_REACHED = 0.8  # share of a figure's frames below the posture and the speed that it is judged by
BINS = ("posture", "speed")  # known of every case of a take with bodies, that all are judged apart by

Sets = Literal["test", "val", "tennis", "cmu"]


@dataclass(frozen=True)
class EvaluationSet:
    """label: its name in tables. subjects: whose clips; of: those of that data set only (clips.data_set). known: the
    lifter may have been trained on them, for nobody is judged by them alone."""

    label: str
    subjects: Subjects
    of: str | None = None
    known: bool = False

    def refuse_known(self, lifter: str) -> None:
        """InputError for a lifter that was trained on these people."""
        opened = load_lifter(lifter) if lifter and not self.known else None
        if isinstance(opened, OwnLifter) and network(opened.model).stated["trained_on"] == self.subjects:
            raise InputError(
                "files-apart",
                f"Expected a lifter that never saw the subjects '{self.subjects}', but {lifter} was trained on them; "
                "give another one (lab testbed takes --trained-on where nobody is judged by its takes).",
            )

    def clips(self) -> tuple[Clip, ...]:
        """The motion capture of the set; InputError where the data is not, or no take of it is long enough."""
        clips = tuple(clip for clip in read_clips(self.subjects) if self.of in (None, data_set(clip)))
        if not any(len(clip) >= MIN_FRAMES for clip in clips):
            raise InputError(
                "nothing-usable",
                f"Expected a take of {MIN_FRAMES} frames or more for the set {self.label}, but the motion capture has "
                "none; set PCNET3D_DATA to a folder that has one.",
            )
        return clips


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
class Configuration:
    """What a report is asked, and what a run can have. people: whose takes; seed: of cameras and detectors. lifter: of
    load_lifter, or "" for the captured joints themselves, measured. bed: the cameras; camera: whether they stand still
    or follow the person. rectifiers: those that are judged by themselves. image: an image tells up, as well as rendered
    rooms do (testbed.simulated_look). up_told: the user tells it. fps: frames a second. focal_known: by the user; else
    the usual one is assumed, as of a video without lines. side: of VIEWS, from which people who do not turn are filmed.
    real: the name of a take before four real cameras (testbed.real_takes), in place of virtual takes; then the image is
    the video's own. errors: a file of angles' errors, as a user gives one. unsuspected: how many times as much the
    detector errs in unusual postures and fast motion, and its scores do not tell (`unsuspected`). bodies: with other
    proportions, for training. laid: of so large a share of the clips only, whose bodies lie (testbed.laid_down). draws,
    part, fit: of the report `errors`."""

    people: Sets = "val"
    seed: int = 0
    lifter: str = "pcnet3d"
    bed: Bed = "wild"
    camera: CameraMotion = "static"
    rectifiers: tuple[Rectifier, ...] = ()
    image: bool = False
    up_told: bool = False
    fps: float = 30.0
    focal_known: bool = False
    side: str = ""
    real: str = ""
    errors: Path | None = None
    unsuspected: float = 1.0
    bodies: BodyRange | None = None
    laid: float = 0.0
    draws: int = 1
    part: Sequence[str] = ()
    fit: bool = False

    @property
    def sets(self) -> tuple[EvaluationSet, ...]:
        return EVALUATION_SETS[self.people]


@dataclass(frozen=True, eq=False)
class Finished:
    """One take. take: as a run leaves it, or None of one that it refuses. truth: what is true of it. label: of the
    set."""

    take: Take | None
    truth: SeenTake
    label: str
    asked: Configuration = Configuration()

    @property
    def done(self) -> Take:
        """The take of one that was not refused, as is all that follows but `levelled`."""
        assert self.take is not None
        return self.take

    @property
    def levelled(self) -> bool:
        return self.take is not None and self.take.need("rectified").level_ok

    @property
    def lifted(self) -> bool:
        """Whether its poses are a lifter's."""
        return self.done.need("poses").made_by.kind == "estimated"

    @property
    def static(self) -> bool:
        return self.truth.up.ndim == 1

    @property
    def rows(self) -> np.ndarray:
        """(T,) of the truth that the take has."""
        return self.done.need("poses").frame_index

    @property
    def times(self) -> np.ndarray:
        """(T,) seconds of the take."""
        return self.done.need("poses").times

    @cached_property
    def stances(self) -> dict[str, np.ndarray]:
        """{name of FEATURES, "r_arm", "l_arm", "posture": (T,)} of each frame's body, as the run has it (posture.py),
        NaN of a body that is not turned."""
        rectified = self.done.need("rectified")
        R_body_from_level = transpose(rectified.R_source_from_body) @ rectified.R_source_from_level
        of = features(rotate(R_body_from_level, self.done.need("filtered").joints), self.times)
        return {**of, "posture": np.where(np.isfinite(of["lean"]), posture(of), np.nan)}

    def reached(self, span: tuple[float, float] = (-np.inf, np.inf)) -> dict[str, np.ndarray]:
        """What a figure of many frames, of those in these seconds, is judged apart by: the posture and the speed that a
        fifth of them reach, in the order of POSTURES, {name: (1,)}."""
        inside = (self.times >= span[0]) & (self.times <= span[1])
        return {name: _reached(self.stances[name][inside]) for name in BINS}

    @cached_property
    def true_angles(self) -> dict[str, AngleSeries]:
        """Of every frame of the truth."""
        joints = smoothed(self.truth.truth, self.truth.time_s)
        return take_angles(TakeJoints(self.truth.truth, joints, self.truth.R_camera_from_body))

    def stated(self, error: np.ndarray, half: np.ndarray, **known: np.ndarray) -> Cases:
        """Cases of the take with an error and a bar. known: beside or in place of what they are judged apart by, BINS,
        which is of the take's frames."""
        bins = {name: self.stances[name] for name in BINS if name not in known}
        return Cases(self.truth.subject, {"error": error, "half": half, **known, **bins}).judged()

    def figure(self, found: float, true: float, error: float | None, **known: np.ndarray) -> Cases:
        """One figure of the take, or a part of it, with its stated standard deviation."""
        half = np.nan if error is None else SD_90 * error
        values = {"error": found - true, "half": half, "true": true}
        return Cases(self.truth.subject, {name: np.array([of]) for name, of in values.items()} | known)

    def captured(self) -> Take:
        """The captured joints after the same stages, up told: what the take's figures are in truth. InputError for a
        camera that moves, whose up nobody can tell."""
        true = replace(self.asked, lifter="", up_told=True, image=False, errors=None)
        return recipe_of(true).build()(given(self.truth, true))


def _reached(values: np.ndarray) -> np.ndarray:
    known = values[np.isfinite(values)]
    return np.quantile(known, [_REACHED], method="nearest") if len(known) else np.array([np.nan])


def finished(
    asked: Configuration,
    sets: Sequence[EvaluationSet] | None = None,
    only: Callable[[Clip], bool] = lambda clip: True,
) -> Iterator[Finished]:
    """Every take of these people, or of the sets given, after a run; only: which of them. InputError where the data is
    not, and for a lifter that cannot be opened."""
    pipeline = recipe_of(asked).build()
    filmed: Iterable[tuple[str, SeenTake, Video | None]]
    if asked.real:
        filmed = real_takes(asked.real)
    else:
        sets = asked.sets if sets is None else sets
        filmed = ((of.label, truth, None) for of in sets for truth in seen_takes(asked, of, only))
    for label, truth, video in filmed:
        before = given(truth, asked, video)
        try:
            take = pipeline(before)
        except InputError:
            take = None
        yield Finished(take, truth, label, asked)


def seen_takes(
    asked: Configuration, of: EvaluationSet, only: Callable[[Clip], bool] = lambda clip: True
) -> Iterator[SeenTake]:
    """Every take of the set of at least MIN_FRAMES frames before a virtual camera; cameras and the detector depend on
    the seed and the clip only. only: which clips. InputError for a lifter that knows these people."""
    of.refuse_known(asked.lifter)
    usual = replace(BEDS[asked.bed], pans=float(asked.camera == "moving"))
    clips = [clip for clip in of.clips() if len(clip) >= MIN_FRAMES and only(clip)]
    for clip in each(clips, of.label, len(clips)):
        views = seen_from(clip, asked.side, usual) if asked.side else usual
        moving: Clip | None = at_rate(clip, asked.fps)
        if asked.laid:
            moving = laid_down(moving, asked.seed, asked.laid)
        if moving is not None and views is not None:
            seen = see(moving, asked.seed, bodies=asked.bodies, views=views)
            yield unsuspected(seen, asked.unsuspected)


def lifted(asked: Configuration, of: EvaluationSet) -> Iterator[LiftedTake]:
    """The set's takes, lifted and no more."""
    for truth in seen_takes(asked, of):
        yield LiftedTake(lifted_by(asked.lifter, truth), truth)


def unsuspected(truth: SeenTake, times: float) -> SeenTake:
    """The take as seen by a detector whose errors are up to so many times as large in unusual postures and fast motion,
    with the same scores: MoveNet's of a man who balances before four cameras are 1.9 to 4.7 % of his box, those of the
    test bed 1.9 (docs/research.md)."""
    if times == 1:
        return truth
    at, seen = truth.joints_camera, truth.keypoints
    exact = truth.focal_px * at[..., :2] / at[..., 2:] + np.array(truth.image_size) / 2
    unusual = growth(features(relative(truth.world), seen.times)).max(axis=1).clip(0, 1)
    joints = exact + (1 + (times - 1) * unusual)[:, None, None] * (seen.joints - exact)
    return replace(truth, keypoints=seen.with_(joints=joints))


def at_rate(clip: Clip, fps: float) -> Clip:
    """The clip at another rate, along cubic splines through the captured joints."""
    if abs(clip.fps - fps) < 1e-6:
        return clip
    from scipy.interpolate import CubicSpline

    captured = np.arange(len(clip)) / clip.fps
    frames = int(captured[-1] * fps + 1e-6) + 1
    joints = CubicSpline(captured, clip.joints.astype(np.float64))(np.arange(frames) / fps)
    return replace(clip, fps=fps, joints=joints.astype(np.float32))


def recipe_of(asked: Configuration) -> Recipe:
    """The default recipe as that configuration has it, from keypoints on or from poses, without files."""
    recipe = load_recipe()
    for stage in _FILES:
        recipe = recipe.without(stage)
    if asked.errors is not None:
        recipe = recipe.with_options("angles", errors=asked.errors)
    if not asked.lifter:
        return recipe
    return recipe.starting_with("lift").with_options("lift", lifter=asked.lifter)


def given(truth: SeenTake, asked: Configuration, video: Video | None = None) -> Take:
    """What a run is given: keypoints, camera and what the user tells, his stature too; or the captured joints. video:
    of a real take."""
    stature_m = implied_stature(truth.truth)
    told = Told(
        camera=asked.camera,
        focal_px=truth.focal_px if asked.focal_known else None,
        gravity=tuple((-truth.up).tolist()) if asked.up_told else None,  # type: ignore[arg-type]
        image_size=truth.image_size,
        stature_m=stature_m if np.isfinite(stature_m) else None,
    )
    seen, camera = truth.keypoints, known_camera(truth.image_size, told.focal_px, None)
    if asked.image and video is not None:
        camera = camera_of(video, [seen], (int(seen.frame_index[0]), int(seen.frame_index[-1])))
    elif asked.image:
        camera = replace(camera, looks=looks(truth, asked.seed))
    take = Take(truth.clip, keypoints=seen, camera=camera, told=told, video=video)
    if asked.lifter:
        return take
    captured = PoseSequence(
        truth.truth,
        H36M17,
        CAMERA.with_(origin="pelvis"),
        time_s=truth.time_s,
        frame_index=np.arange(len(truth.time_s)),
        made_by=MadeBy("measured", "motion capture"),
    )
    return take.with_(poses=captured)


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
