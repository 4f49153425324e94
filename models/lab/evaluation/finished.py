"""Finished takes with their truth, in every configuration that a run can have: what stated errors are judged by.

A take here is what `pcnet3d run` leaves before it writes files: the stages of the default recipe, from keypoints of the
test bed on, or of a real video with truth, so that what is judged is what a user gets.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ....pipeline.core.anthropometry import implied_stature
from ....pipeline.core.camera import Look
from ....pipeline.core.errors import InputError
from ....pipeline.core.frames import CAMERA
from ....pipeline.core.layouts import H36M17
from ....pipeline.core.pose import MadeBy
from ....pipeline.core.rotations import rotate, transpose
from ....pipeline.core.take import CameraMotion, Take, Told
from ....pipeline.files.video_frames import shown_size
from ....pipeline.reading.load import read_video
from ....pipeline.reading.mocap import Clip
from ....pipeline.running.progress import each
from ....pipeline.running.recipe import Recipe, load_recipe
from ...angle_error.posture import features, growth
from ...common.canonical import R_world_from_body
from ...gravity.view import camera_of, known_camera
from ...lifter.features import body_rays
from ..mocap.clips import lying
from .foreign import Foreign
from .real_data import MOVING, found_keypoints, mid_hips, read_moving, whole_body
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
    the usual one is assumed, as of a video without lines. real: the man who balances before four real cameras
    (real_data.py), in place of virtual takes; then the image is the video's own. foreign: another lifter made the
    poses, and the run is given them with the keypoints beside. errors: a file of angles' errors, as a user gives one.
    unsuspected: the detector errs more in unusual postures and fast motion, and its scores do not tell
    (`unsuspected`)."""

    image: bool = False
    camera: CameraMotion = "static"
    up_told: bool = False
    lifter: str = "pcnet3d"
    bed: Bed = "wild"
    fps: float = 30.0
    focal_known: bool = False
    real: bool = False
    foreign: Foreign | None = None
    errors: Path | None = None
    unsuspected: bool = False

    def __str__(self) -> str:
        lifter = self.foreign.name if self.foreign else self.lifter
        parts = [
            f"lifter {lifter}" if lifter else "motion capture",
            "real take" if self.real else f"{self.bed} cameras, {self.camera}, {self.fps:g} fps",
            "with the image" * self.image,
            "up given" * self.up_told,
            "focal known" * self.focal_known,
            "unsuspected errors" * self.unsuspected,
        ]
        return ", ".join(filter(None, parts))


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
        true = replace(self.configuration, lifter="", up_told=True, image=False, foreign=None, errors=None)
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
    views = replace(BEDS[configuration.bed], pans=float(configuration.camera == "moving"))
    for of in sets:
        clips = [clip for clip in of.clips() if len(clip) >= MIN_FRAMES and only(clip)]
        for clip in each(clips, f"{of.label}, {configuration}", len(clips)):
            truth = see(at_rate(clip, configuration.fps), question.seed, views=views)
            truth = unsuspected(truth) if configuration.unsuspected else truth
            yield of.label, truth, given(truth, question.seed, configuration)


def unsuspected(truth: SeenTake, times: float = 2.0) -> SeenTake:
    """The take as seen by a detector whose errors are up to so many times as large in unusual postures and fast motion,
    with the same scores: MoveNet's of a man who balances before four cameras are 1.9 to 4.7 % of his box, those of the
    test bed 1.9 (real_data.py, docs/research.md)."""
    at, seen = truth.joints_camera, truth.keypoints
    exact = truth.focal_px * at[..., :2] / at[..., 2:] + np.array(truth.image_size) / 2
    world = rotate(transpose(truth.R_camera_from_world), truth.truth)
    unusual = growth(features(world, seen.times)).max(axis=1).clip(0, 1)
    joints = exact + (1 + (times - 1) * unusual)[:, None, None] * (seen.joints - exact)
    return replace(truth, keypoints=seen.with_(joints=joints))


def _real(question: Question, configuration: Configuration) -> Iterator[tuple[str, SeenTake, Take]]:
    """By the keypoints that a run finds. The truth has the limbs alone, pelvis and thorax between them; other joints
    are NaN."""
    cameras, true = read_moving()
    world = whole_body(true.limbs) + mid_hips(true.limbs)
    for name, camera in each(cameras.items(), str(configuration), len(cameras)):
        assert camera.R_camera_from_world is not None
        video = read_video(camera.video)
        joints, keypoints = camera.to_camera(world), found_keypoints(video)
        truth = SeenTake(
            keypoints=keypoints,
            image_size=shown_size(video),
            focal_px=float(camera.focal_px.mean()),
            joints_camera=joints,
            R_camera_from_body=camera.R_camera_from_world @ R_world_from_body(world),
            R_camera_from_world=camera.R_camera_from_world,
            R_camera_from_ray=body_rays(joints),
            lying=lying(world),
            clip=name,
            subject="real take",
            source=MOVING,
        )
        asked = given(truth, question.seed, replace(configuration, image=False))
        asked = asked.with_(video=video)
        if configuration.image:
            rows = int(keypoints.frame_index[0]), int(keypoints.frame_index[-1])
            asked = asked.with_(camera=camera_of(video, keypoints, rows))
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
    if configuration.foreign or not configuration.lifter:
        return recipe
    return recipe.starting_with("lift").with_options("lift", lifter=configuration.lifter)


def given(truth: SeenTake, seed: int, configuration: Configuration) -> Take:
    """What a run is given: keypoints, camera and what the user tells, his stature too; or the captured joints."""
    told = Told(
        camera=configuration.camera,
        focal_px=truth.focal_px if configuration.focal_known else None,
        gravity=tuple((-truth.up).tolist()) if configuration.up_told else None,  # type: ignore[arg-type]
        image_size=truth.image_size,
        stature_m=implied_stature(truth.truth),
    )
    camera = known_camera(truth.image_size, told.focal_px, None)
    if configuration.image:
        camera = replace(camera, looks=looks(truth, seed))
    take = Take(truth.clip, keypoints=truth.keypoints, camera=camera, told=told)
    if configuration.foreign:
        return take.with_(poses=configuration.foreign.poses(truth, configuration.bed, seed))
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
