"""Takes whose truth is known, and what a run makes of them.

A take is motion capture through a virtual camera, a noisy detector and a lifter, or a real video with truth
(docs/training.md). A virtual one depends on the seed and its clip's name only, so a subset of the clips gives the same
takes. A finished take is what `pcnet3d run` leaves before it writes files: the stages of the default recipe, so that
what is judged is what a user gets. Other lifters than the built-in one are those of other packages and files.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import torch
from typer import Argument, Option

from ...pipeline.core.anthropometry import implied_stature
from ...pipeline.core.camera import Look
from ...pipeline.core.device import computing_on
from ...pipeline.core.errors import InputError, readable
from ...pipeline.core.frames import CAMERA, IMAGE
from ...pipeline.core.layouts import H36M17, LIMBS
from ...pipeline.core.lifted import ToLift
from ...pipeline.core.measures import SD_90
from ...pipeline.core.messages import how_many
from ...pipeline.core.pose import MadeBy, PoseSequence
from ...pipeline.core.rotations import is_finite, rotate, transpose, unit
from ...pipeline.core.take import CameraMotion, Take, Told, Video
from ...pipeline.files.arrays import load_all, write_arrays
from ...pipeline.files.atomic import refuse_unwritable
from ...pipeline.plugins.protocols import Rectifier
from ...pipeline.reading.load import read_video
from ...pipeline.reading.people import choose_person
from ...pipeline.reading.settings import OnDevice
from ...pipeline.running.progress import each
from ...pipeline.running.recipe import Recipe, load_recipe
from ...pipeline.signals.filters import derivative
from ..angle_error.posture import features, growth, posture
from ..angle_error.take_angles import AngleSeries, TakeJoints, smoothed, take_angles
from ..common.canonical import R_world_from_body
from ..common.metrics import relative
from ..detector.load import load_detector
from ..detector.video import detect as detect_in
from ..gravity.images import tangent
from ..gravity.view import camera_of, known_camera
from ..lifter.builtin import OwnLifter, network
from ..lifter.load import load_lifter
from .cases import Cases, scaled
from .clips import Clip, Subjects, data_folder, data_set, lying, read_clips
from .synthetic import TYPICAL, WILD, BodyRange, Cameras, Noise, NumpyDraw, ViewRange, detect, place, vary

MIN_FRAMES = 30
LOOK_DEG = np.array([1.2, 0.6])  # pitch and roll of up by an image: what photographs give
_LAID_SD_DEG = 12.0  # of how far from level a laid body lies
_ON_THE_FLOOR = 0.05  # share of its joints below the floor

BALANCING, STANDING = "pose2sim", "pose2sim_static"  # folders of the data's README, under real/
_DETECTOR = Path("models") / "movenet_lightning_int8.onnx"

Bed = Literal["wild", "typical"]
# Degrees from where a person faces to the camera, to the right or the left.
VIEWS = {"front": (0.0, 15.0), "oblique": (30.0, 60.0), "side": (75.0, 105.0), "back": (165.0, 180.0)}
_STEADY = (
    0.9  # mean resultant of the headings, below which a person turns: a standard deviation of 26 degrees
)
BEDS: dict[Bed, ViewRange] = {"wild": WILD, "typical": TYPICAL}


@dataclass(frozen=True, eq=False)
class SeenTake:
    """One clip as a camera and a detector saw it, and what is true about it.

    keypoints: the detector's answer, IMAGE, pixels, of the frames in which it finds somebody. image_size, focal_px: the
        camera's.
    time_s: (T,) of all frames. joints_camera: (T, 17, 3) metres, the truth, origin at the camera.
    R_camera_from_world: (3, 3), or (T, 3, 3) of a camera that pans, world +Z up; its third column is `up`.
    clip, subject: where it comes from.
    """

    keypoints: PoseSequence
    image_size: tuple[int, int]
    focal_px: float
    time_s: np.ndarray
    joints_camera: np.ndarray
    R_camera_from_world: np.ndarray
    clip: str
    subject: str

    @cached_property
    def R_camera_from_body(self) -> np.ndarray:
        """(T, 3, 3), the truth by design.md section 4."""
        return self.R_camera_from_world @ R_world_from_body(self.world)

    @cached_property
    def lying(self) -> np.ndarray:
        """(T,) by trunk angle."""
        return lying(self.world)

    @property
    def up(self) -> np.ndarray:
        """(3,) or (T, 3) against gravity, in the camera."""
        return self.R_camera_from_world[..., :, 2]

    @property
    def truth(self) -> np.ndarray:
        """(T, 17, 3) metres, CAMERA axes, relative to the pelvis."""
        return relative(self.joints_camera)

    @cached_property
    def world(self) -> np.ndarray:
        """(T, 17, 3) metres, +Z up, the origin at the camera."""
        return rotate(transpose(self.R_camera_from_world), self.joints_camera)


@dataclass(frozen=True, eq=False)
class LiftedTake:
    """What a user has, and the truth behind it. lifted: CAMERA axes, relative to the pelvis, unit arbitrary."""

    lifted: PoseSequence
    seen: SeenTake


def lifted_by(model: str | Path, seen: SeenTake, up: np.ndarray | None = None) -> PoseSequence:
    """The lift by any lifter of load_lifter, which is told up (3,) only if it takes it."""
    lifter = load_lifter(model)
    told = up if "up" in lifter.takes else None
    return lifter.lift(ToLift(seen.keypoints, seen.image_size, up=told)).noted()


def laid_down(clip: Clip, seed: int, share: float) -> Clip | None:
    """The motion of a body that lies on its back, front or a side: turned about a level axis by about 90 degrees; None
    of all but such a share of the clips."""
    from scipy.spatial.transform import Rotation

    rng = _rng(clip, seed, 1)
    if rng.uniform() >= share:
        return None
    towards, angle = rng.uniform(0, 2 * np.pi), np.radians(90 + _LAID_SD_DEG * rng.standard_normal())
    R = Rotation.from_rotvec(angle * np.array([np.cos(towards), np.sin(towards), 0.0])).as_matrix()
    pelvis = clip.joints[:, [H36M17.index("pelvis")]]
    joints = pelvis + rotate(R, clip.joints - pelvis)
    joints[..., 2] -= np.quantile(joints[..., 2], _ON_THE_FLOOR)
    return replace(clip, joints=joints.astype(np.float32))


def see(
    clip: Clip,
    seed: int,
    *,
    noise: Noise | None = None,
    bodies: BodyRange | None = None,
    views: ViewRange = WILD,
    cameras: Cameras | None = None,
) -> SeenTake:
    """A clip before one camera and a noisy detector; deterministic in the seed and the clip's name. cameras: that one,
    of leading shape (1,), in place of one that is drawn."""
    draw = NumpyDraw(_rng(clip, seed))
    moving = torch.from_numpy(clip.joints[None].astype(np.float64))
    if bodies is not None:
        moving = vary(moving, draw, bodies)
    cameras = place(moving, draw, views) if cameras is None else cameras
    shown = cameras.to_camera(moving)
    pixels, confidence = (
        found[0].numpy() for found in detect(cameras.project(shown), shown, draw, clip.fps, noise)
    )
    R_camera_from_world = cameras.R_camera_from_world[0].numpy()
    time_s = np.arange(len(clip)) / clip.fps
    width, height = (int(side) for side in cameras.image_size[0])
    return SeenTake(
        keypoints=PoseSequence(pixels, H36M17, IMAGE, confidence, time_s, np.arange(len(clip))),
        image_size=(width, height),
        focal_px=float(cameras.focal_px[0]),
        time_s=time_s,
        joints_camera=shown[0].numpy(),
        R_camera_from_world=R_camera_from_world if views.pans else R_camera_from_world[0],
        clip=clip.name,
        subject=clip.subject,
    )


def seen_from(clip: Clip, side: str, views: ViewRange) -> ViewRange | None:
    """The range with the yaws from which a camera sees that side of VIEWS, of every second clip on the person's left;
    None of a clip whose person turns."""
    back = R_world_from_body(clip.joints.astype(np.float64))[:, :2, 0]
    facing = -back[is_finite(back)].mean(axis=0)
    if not np.linalg.norm(facing) >= _STEADY:
        return None
    left = 1 if zlib.crc32(clip.name.encode()) % 2 else -1
    at = np.degrees(np.arctan2(facing[1], facing[0])) + 180 + left * np.array(VIEWS[side])
    return replace(views, yaw_deg=(float(at.min()), float(at.max())))


def simulated_look(up: np.ndarray, seed: int, clip: str) -> Look:
    """What an image says about a true up (3,), as well as images of rooms and streets do (docs/up.md); the same for
    the same seed and clip."""
    rng = np.random.default_rng([seed, zlib.crc32(clip.encode()), 1])
    plane = tangent(up)
    said = unit(up + plane @ (np.radians(LOOK_DEG) * rng.standard_normal(2)))
    plane = tangent(said)
    return Look(0, said, plane @ np.diag(np.radians(LOOK_DEG) ** 2) @ plane.T, failure=0.01)


def joints_of(poses: PoseSequence, truth: np.ndarray) -> np.ndarray:
    """(T, 17, 3) a lift at the truth's scale, one factor for the take."""
    return scaled(poses.joints.astype(np.float64), truth, "take")


def accelerations(path: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(T, J, 3) m/s^2 of path (T, J, 3) metres without gaps, filtered."""
    return derivative(smoothed(path, time_s), time_s, order=2)


def _rng(clip: Clip, *seeds: int) -> np.random.Generator:
    return np.random.default_rng([*seeds, zlib.crc32(clip.name.encode())])


def real_takes(name: str) -> Iterator[tuple[str, SeenTake, Video]]:
    """("real take", what is true, the video) of each camera of a real take, BALANCING or STANDING. The truth has the
    limbs alone, pelvis and thorax between them; other joints are NaN, and all of a take of which only up is known.
    InputError where the data is not."""
    folder = data_folder() / "real" / name
    cameras, limbs = read_cameras(folder), read_limbs(folder)
    for camera, said in each(cameras.items(), "cameras", len(cameras)):
        video, keypoints = read_seen(folder / f"{camera}.mp4")
        joints = np.full((len(video.time_s), len(H36M17), 3), np.nan)
        if limbs is None:
            up = unit(said["up_in_camera"])
            across = tangent(up)[:, 0]
            R_camera_from_world = np.column_stack([across, np.cross(up, across), up])
        else:
            joints[:, H36M17.indices(LIMBS)] = limbs
            for middle, part in (("pelvis", "hip"), ("thorax", "shoulder")):
                both = H36M17.indices((f"r_{part}", f"l_{part}"))
                joints[:, H36M17.index(middle)] = joints[:, both].mean(axis=1)
            R_camera_from_world = said["R_camera_from_world"]
            joints = rotate(R_camera_from_world, joints) + said["t_m"]
        lens, time_s = float(said["focal_px"].mean()), video.time_s
        truth = SeenTake(
            keypoints, video.size, lens, time_s, joints, R_camera_from_world, camera, "real take"
        )
        yield "real take", truth, video


def read_cameras(folder: Path) -> dict[str, dict[str, np.ndarray]]:
    """{camera: what its take's cameras.json says of it}: up_in_camera (3,), against gravity, and focal_px (2,); of a
    take with truth also R_camera_from_world (3, 3), world +Z up, and t_m (3,): x_camera = R x_world + t. InputError
    when the file is missing."""
    path = folder / "cameras.json"
    with readable(path, "the cameras of a real take"):
        cameras = json.loads(path.read_text(encoding="utf-8"))["cameras"]
    return {camera: {key: np.array(of) for key, of in said.items()} for camera, said in cameras.items()}


def read_limbs(folder: Path) -> np.ndarray | None:
    """A real take's true limbs (T, 12, 3) in metres, joints LIMBS, world +Z up, row i of frame i of every video; None
    of a take that has none."""
    path = folder / "truth.npz"
    if not path.exists():
        return None
    arrays = load_all(path, "joints", "joint_names")
    names = arrays["joint_names"].tolist()
    return arrays["joints"][:, [names.index(joint) for joint in LIMBS]].astype(np.float64)


@cache
def read_seen(path: Path) -> tuple[Video, PoseSequence]:
    """A video, and in COCO17, IMAGE, whom the data's own detector sees in it for longest, looking as often as in a run;
    once in a process, for several reports on it. InputError where nobody is seen."""
    video = read_video(path)
    found = detect_in(video, load_detector(data_folder() / _DETECTOR, looks=None))
    if not len(found.person):
        raise InputError("nothing-usable", f"Expected a person in {path}, but {found.method} finds nobody.")
    return video, choose_person(found.people(), "longest", str(path))


_LOOK_EVERY = 10  # frames of a moving camera whose image is asked for up
_ANSWERED = 0.8  # share of them that tells it
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
    rooms do (`simulated_look`). up_told: the user tells it. fps: frames a second. focal_known: by the user; else
    the usual one is assumed, as of a video without lines. side: of VIEWS, from which people who do not turn are filmed.
    real: the name of a take before four real cameras (`real_takes`), in place of virtual takes; then the image is
    the video's own. errors: a file of angles' errors, as a user gives one. unsuspected: how many times as much the
    detector errs in unusual postures and fast motion, and its scores do not tell (`unsuspected`). bodies: with other
    proportions, for training. laid: of so large a share of the clips only, whose bodies lie (`laid_down`). draws,
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
    for stage in ("record", "export", "report"):  # which only write
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


def write_takes(
    subjects: Annotated[Subjects, Argument(help="Whose takes.")],
    output: Annotated[Path, Option("-o", "--output", help="The .npz file.")],
    seed: Annotated[int, Option(min=0, help="Random seed.")] = 0,
    lifter: Annotated[str, Option(help="A name or an .onnx file, not trained on the subjects.")] = "pcnet3d",
    bodies: Annotated[bool, Option("--bodies", help="Draw other proportions and mirror some.")] = False,
    bed: Annotated[Bed, Option(help="Cameras: from everywhere, or as people film.")] = "wild",
    trained_on: Annotated[bool, Option("--trained-on", help="Also people the lifter knows.")] = False,
    laid: Annotated[float, Option(min=0, max=1, help="Only this share, with bodies that lie.")] = 0.0,
    device: OnDevice = "auto",
) -> None:
    """Write lifted takes with ground truth for training.

    One .npz of plain arrays, takes one after another: lifted, truth (N, 17, 3), R_camera_from_body (N, 3, 3),
    lying (N,); take_start (C + 1,), clip (C,).
    """
    refuse_unwritable(output.parent)
    drawn = BodyRange() if bodies else None
    with computing_on(device):
        asked = Configuration(seed=seed, lifter=lifter, bed=bed, bodies=drawn, laid=laid)
        takes = list(lifted(asked, EvaluationSet(subjects, subjects, known=trained_on)))
    if not takes:
        raise InputError(
            "nothing-usable", f"No take of the subjects '{subjects}' was laid down; give a larger --laid."
        )
    output.parent.mkdir(parents=True, exist_ok=True)
    seen, ends = [take.seen for take in takes], np.cumsum([0, *(len(take.lifted) for take in takes)])
    write_arrays(
        output,
        lifted=np.concatenate([take.lifted.joints for take in takes]),
        truth=np.concatenate([take.truth for take in seen]).astype(np.float32),
        R_camera_from_body=np.concatenate([take.R_camera_from_body for take in seen]),
        lying=np.concatenate([take.lying for take in seen]),
        take_start=ends,
        clip=np.array([take.clip for take in seen]),
    )
    print(f"{output}: {how_many(len(takes), 'take')}, {ends[-1]:,} frames")
