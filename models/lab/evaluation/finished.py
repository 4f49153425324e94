"""Finished takes with their truth, in every configuration that a run can have: what stated errors are judged by.

A take here is what `pcnet3d run` leaves before it writes files: the stages of the default recipe, from keypoints of the
test bed on, so that what is judged is what a user gets.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.camera import PRIOR_FOCAL, PRIOR_FOCAL_SPREAD, Camera, Look
from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import CAMERA
from ....pipeline.core.pose import MadeBy
from ....pipeline.core.take import CameraMotion, Take, Told
from ....pipeline.reading.mocap.clip import Clip
from ....pipeline.running.progress import each
from ....pipeline.running.recipe import Recipe, load_recipe
from .sets import EvaluationSet, Question
from .take_answers import simulated_look
from .testbed import BEDS, MIN_FRAMES, Bed, SeenTake, see

_LOOK_EVERY = 10  # frames of a moving camera whose image is asked for up
_ANSWERED = 0.8  # share of them that tells it
_FILES = ("record", "export", "report")  # stages that only write


@dataclass(frozen=True)
class Configuration:
    """What a run can have. image: an image tells up, as well as rendered rooms do (take_answers.simulated_look).
    up_told: the user tells it. lifter: of load_lifter, or "" for the captured joints themselves, measured. bed: the
    cameras; camera: whether they stand still or follow the person. fps: frames a second. focal_known: by the user; else
    the usual one is assumed, as of a video without lines."""

    image: bool = False
    camera: CameraMotion = "static"
    up_told: bool = False
    lifter: str = "pcnet3d"
    bed: Bed = "wild"
    fps: float = 30.0
    focal_known: bool = False

    def __str__(self) -> str:
        return ", ".join(
            [
                f"lifter {self.lifter}" if self.lifter else "motion capture",
                f"{self.bed} cameras, {self.camera}, {self.fps:g} fps",
                *(["with the image"] if self.image else []),
                *(["up told"] if self.up_told else []),
                *(["focal known"] if self.focal_known else []),
            ]
        )


@dataclass(frozen=True, eq=False)
class Finished:
    """One take. take: as a run leaves it, or None where it ends with `reason`. truth: what is true of it. person: by
    whom takes are weighted (people.by_person); label: of the set; clip: the take's id, the same in every
    configuration."""

    take: Take | None
    truth: SeenTake
    person: str
    label: str
    clip: str
    reason: str = ""


def configurations(lifters: tuple[str, ...] = ("pcnet3d", "")) -> list[Configuration]:
    """All that differ: every camera, rate and knowledge of up, for each lifter. Nobody tells the one up of a camera
    that moves."""
    cameras: tuple[CameraMotion, ...] = ("static", "moving")
    return [
        Configuration(image, camera, up_told, lifter, bed, fps)
        for lifter, bed, camera, fps, (image, up_told) in product(
            lifters, BEDS, cameras, (30.0, 60.0), ((False, False), (True, False), (False, True))
        )
        if not (up_told and camera == "moving")
    ]


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
    pipeline = _recipe(question, configuration).build()
    views = replace(BEDS[configuration.bed], pans=float(configuration.camera == "moving"))
    for of in question.sets if sets is None else sets:
        clips = [clip for clip in of.clips() if len(clip) >= MIN_FRAMES and only(clip)]
        for clip in each(clips, f"{of.label}, {configuration}", len(clips)):
            truth = see(at_rate(clip, configuration.fps), question.seed, views=views)
            take, reason = None, ""
            try:
                take = pipeline(_asked(truth, question.seed, configuration))
            except InputError as error:
                reason = str(error)
            yield Finished(take, truth, clip.subject, of.label, clip.name, reason)


def at_rate(clip: Clip, fps: float) -> Clip:
    """The clip at another rate, along cubic splines through the captured joints."""
    if abs(clip.fps - fps) < 1e-6:
        return clip
    from scipy.interpolate import CubicSpline

    captured = np.arange(len(clip)) / clip.fps
    frames = int(captured[-1] * fps + 1e-6) + 1
    joints = CubicSpline(captured, clip.joints.astype(np.float64))(np.arange(frames) / fps)
    return replace(clip, fps=fps, joints=joints.astype(np.float32))


def _recipe(question: Question, configuration: Configuration) -> Recipe:
    recipe = load_recipe()
    for stage in _FILES:
        recipe = recipe.without(stage)
    if not configuration.lifter:
        return recipe
    return recipe.starting_with("lift").with_options("lift", lifter=configuration.lifter, flip=question.flip)


def _asked(truth: SeenTake, seed: int, configuration: Configuration) -> Take:
    """What a run is given: keypoints, camera and what the user tells, his stature too; or the captured joints."""
    told = Told(
        camera=configuration.camera,
        focal_px=truth.focal_px if configuration.focal_known else None,
        gravity=tuple((-truth.up).tolist()) if configuration.up_told else None,  # type: ignore[arg-type]
        image_size=truth.image_size,
        stature_m=implied_stature(truth.truth),
    )
    guess = PRIOR_FOCAL * max(truth.image_size)
    camera = Camera(truth.image_size, guess, guess * PRIOR_FOCAL_SPREAD, "prior")
    if configuration.focal_known:
        camera = Camera(truth.image_size, truth.focal_px, 0.0, "told")
    if configuration.image:
        camera = replace(camera, looks=looks(truth, seed))
    take = Take(truth.clip, keypoints=truth.keypoints, camera=camera, told=told)
    if configuration.lifter:
        return take
    frame = CAMERA.with_(origin="pelvis")
    return take.with_(
        poses=truth.keypoints.with_(
            joints=truth.truth, frame=frame, confidence=None, made_by=MadeBy("measured", "motion capture")
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
