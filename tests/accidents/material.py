"""What accidents are made from: takes as a user gives them, and a run of one without the files that it would write."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from golden.detections import AS_COCO, coco_tracks
from golden.lifts import lift
from pcnet3d.examples.walker import side_camera, walker
from pcnet3d.examples.walker.files import write_video
from pcnet3d.models.lab.beds import BEDS, MIN_FRAMES, Bed, see
from pcnet3d.models.lab.clips import Clip, Subjects, data_folder, person, read_clips
from pcnet3d.models.lab.synthetic import Noise
from pcnet3d.pipeline.core.anthropometry import implied_stature
from pcnet3d.pipeline.core.conversions import remap
from pcnet3d.pipeline.core.frames import CAMERA
from pcnet3d.pipeline.core.frames import IMAGE as _IMAGE
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, COCO17, H36M17, HALPE26
from pcnet3d.pipeline.core.pose import PoseSequence
from pcnet3d.pipeline.core.take import Take
from pcnet3d.pipeline.reading.load import read_video
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.pipeline.running.recipe import planned

BED = ("07_03", "08_04", "accad-m1_run", "accad-m1_lift-box", "tennis-jangel_Derecha_0")
_WALK_CROP = "lifter/walk_crop.npz"
_MOST = 240  # frames of a take of the test bed
_WRITE = ("record", "export", "report")
People = Literal["val", "train", "test", "real"]
_PARTS: dict[str, tuple[Subjects, ...]] = {
    "val": ("val",), "train": ("train",), "test": ("test", "hdm05", "tennis"),
}  # fmt: skip
_OTHER_NOISE, _LASTS = 0.015, 0.8  # of the body's height, and correlation from frame to frame
_LENGTHS = (36, 60, 90, 240, 45)  # rows
_FIRST_SEED = 40  # of cameras and noise, which no rule was chosen by


@dataclass(frozen=True, eq=False)
class Given:
    """What a user gives a run. points: (T, 17, 3) COCO's keypoints, pixels and score, of these frames (T,); poses: (T,
    17, 3) H36M17 in CAMERA axes, of the same frames. other: a second track, frames and points. words: fields of
    RunOptions besides; settings: its settings."""

    frames: np.ndarray
    points: np.ndarray | None
    poses: np.ndarray | None = None
    unit: str = "arbitrary"
    video: Path | None = None
    time_s: np.ndarray | None = None
    words: dict[str, Any] = field(default_factory=dict)
    settings: dict[str, Any] = field(default_factory=dict)

    def with_(self, **changes: Any) -> Given:
        """A copy with these changes."""
        return replace(self, **changes)

    def at(self, rows: np.ndarray | slice, **changes: Any) -> Given:
        """The same with the points and poses of these rows, and these changes."""
        held = {
            name: values[rows] for name in ("points", "poses") if (values := getattr(self, name)) is not None
        }
        return replace(self, **held, **changes)

    @property
    def size(self) -> np.ndarray:
        """(2,) of the image."""
        return np.array(self.words["image_size"], dtype=float)


Bases = dict[str, Given]


def run(given: Given, folder: Path) -> Take:
    """The take as `pcnet3d run` has it before it writes. InputError as there."""
    folder.mkdir(parents=True, exist_ok=True)
    words = dict(given.words)
    if given.points is not None:
        words["keypoints"] = coco_tracks(folder, {"0": (given.frames, given.points)})
    if given.video is not None:
        words.pop("image_size", None)
        words |= {"video": given.video}
        words.pop("fps") if words.get("fps") == 30.0 else None
    if given.poses is not None:
        words["poses"] = folder / "poses.npz"
        beside: dict[str, Any] = {} if given.time_s is None else {"time_s": given.time_s}
        if given.points is not None or not (np.diff(given.frames) == 1).all():
            beside["frame_index"] = given.frames
        np.savez(words["poses"], joints=given.poses.astype(np.float32), **beside)
        words["adapter"] = "arrays"
        words["options"] = {"layout": "H36M17", "frame": "CAMERA", "unit": given.unit}
        if given.points is None:  # an image's size and a focal length are refused then, as without use
            words.pop("image_size", None)
            words.pop("focal", None)
    options = RunOptions(**words, settings=given.settings)
    recipe = planned(options)
    for stage in _WRITE:
        recipe = recipe.without(stage)
    return recipe.build()(open_take(options))


def _coco(keypoints: PoseSequence) -> np.ndarray:
    joints = keypoints.joints.astype(float)
    rows = AS_COCO if keypoints.layout == H36M17 else keypoints.layout.indices(COCO17.joints)
    score = np.nan_to_num(keypoints.confidence[:, rows, None], nan=0.9)
    points = np.concatenate([joints[:, rows], score], axis=-1)
    return np.where(np.isfinite(points).all(-1, keepdims=True), points, 0.0)


def bases(folder: Path) -> dict[str, Given]:
    """Takes to be changed, by name: lifted in the run, and ("... poses") with poses of their own. Those that the data
    folder has."""
    found = {"walker": _walker(folder)}
    if (data_folder() / _WALK_CROP).exists():
        found["walk_crop"] = _walk_crop()
    found |= {clip.name: seen_take(clip, "typical", 0) for clip in read_clips("val") if clip.name in BED}
    for name in {"walker", "walk_crop", BED[0], BED[3]}.intersection(found):
        found[f"{name} poses"] = _lifted(found[name])
    return found


def _walker(folder: Path) -> Given:
    folder.mkdir(parents=True, exist_ok=True)
    walk = walker()
    camera = side_camera(walk)
    video = folder / "walker.mp4"
    if not video.exists():
        write_video(video, walk, camera)
    rng = np.random.default_rng(0)
    points = camera.project(walk.world)[:, AS_COCO] + rng.normal(0, 0.7, (len(walk), 17, 2))
    points = np.concatenate([points, np.full((len(walk), 17, 1), 0.9)], axis=-1)
    size = (camera.width, camera.height)
    words = {"image_size": size, "fps": 30.0, "stature": 1.75, "focal": camera.focal_px}
    return Given(np.arange(len(walk)), points, video=video, words=words)


def _walk_crop() -> Given:
    data = np.load(data_folder() / _WALK_CROP)
    video = data_folder() / "video/walk_crop.mp4"
    words = {"image_size": tuple(int(x) for x in data["image_size"]), "fps": 30.0, "stature": 1.75}
    points = data["movenet_kp2d"].astype(float)
    return Given(np.arange(len(points)), points, video=video, words=words)


def seen_take(clip: Clip, bed: Bed, seed: int, noise: Noise | None = None) -> Given:
    """A clip of motion capture as a camera and a detector see it."""
    take = see(clip, seed, noise=noise, views=BEDS[bed])
    points = _coco(take.keypoints)[:_MOST]
    words = {
        "image_size": take.image_size,
        "fps": 30.0,
        "stature": round(float(implied_stature(take.truth)), 2),
    }
    return Given(np.arange(len(points)), points, words=words)


def _lifted(given: Given) -> Given:
    """The same with poses that the built-in lifter made, as another program's."""
    size = given.words["image_size"]
    points = PoseSequence(
        given.points[..., :2], COCO17, _IMAGE, given.points[..., 2], given.frames / 30.0, given.frames
    )
    return given.with_(
        poses=lift(remap(points, H36M17), size, given.words.get("focal")).joints.astype(float), video=None
    )


def honest(people: People, each: int) -> Iterator[tuple[str, str, Given]]:
    """(person, take, what is given) of takes that nothing was done to, limbs exchanged by a detector neither: `each`
    takes of every person before one kind of cameras after the other, as keypoints alone, poses alone and both in turn,
    of 36 to 240 rows. "real": files of detectors and lifters.
    """
    if people == "real":
        yield from ((name.partition(",")[0], name, given) for name, given in _real())
        return
    of_person: dict[str, list[Clip]] = {}
    for clip in (clip for part in _PARTS[people] for clip in read_clips(part)):
        if len(clip) >= MIN_FRAMES and person(clip) is not None:
            of_person.setdefault(clip.subject, []).append(clip)
    for subject, clips in of_person.items():
        step = max(len(clips) // each, 1)
        for number in range(each):
            clip = clips[number * step % len(clips)]
            bed = tuple(BEDS)[number // 3 % len(BEDS)]
            given = seen_take(clip, bed, _FIRST_SEED + number, Noise(swap_rate=0.0))
            given = _cut(given, _LENGTHS[number % len(_LENGTHS)], number)
            form = ("keypoints", "both", "poses")[number % 3]
            if form != "keypoints":
                given = given.with_(poses=_lifted(_by_another(given, number)).poses)
            given = given.with_(points=None) if form == "poses" else given
            yield subject, f"{clip.name} {bed} {number} {form}", given


def _cut(given: Given, rows: int, seed: int) -> Given:
    """So many rows of a take, from somewhere in it on."""
    first = int(np.random.default_rng(seed).integers(max(len(given.points) - rows, 0) + 1))
    return given.at(slice(first, first + rows), frames=given.frames[:rows])


def _by_another(given: Given, seed: int) -> Given:
    """The same keypoints as another detector, whose errors last for some frames too, would have them."""
    points = given.points.copy()
    found = (points[..., 2:] > 0).all(axis=-1)
    size = np.median(
        [np.ptp(row[there, 1]) for row, there in zip(points[..., :2], found, strict=True) if there.any()]
    )
    noise = np.random.default_rng(seed).normal(0, _OTHER_NOISE * size, points[..., :2].shape)
    for row in range(1, len(noise)):
        noise[row] = _LASTS * noise[row - 1] + np.sqrt(1 - _LASTS**2) * noise[row]
    points[..., :2] += np.where(found[..., None], noise, 0.0)
    return given.with_(points=points)


def _real() -> Iterator[tuple[str, Given]]:
    """(name, what is given) of detectors' and lifters' files of real films, and of captured joints."""
    data = data_folder()
    for name, film in (("boxing", None), ("demo_man", "sports2d_demo.mp4"), ("walk_crop", "walk_crop.mp4")):
        held = np.load(data / f"lifter/{name}.npz")
        words = {"image_size": tuple(int(side) for side in held["image_size"]), "fps": 30.0}
        frames = np.arange(len(held["movenet_kp2d"]))
        found = Given(frames, held["movenet_kp2d"].astype(float), words=words)
        yield f"{name}, MoveNet", found
        yield f"{name}, MoveNet and lifted", _lifted(found)
        yield f"{name}, MoveNet beside its video", found.with_(video=film and data / "video" / film)
        marks = PoseSequence(
            held["blazepose_kp2d"][..., :2], BLAZEPOSE33, _IMAGE, held["blazepose_kp2d"][..., 2]
        )
        world = remap(PoseSequence(held["blazepose_world"], BLAZEPOSE33, CAMERA), H36M17).joints.astype(float)
        yield from _forms(f"{name}, BlazePose", found.with_(points=_coco(marks), poses=world, unit="m"))
        if name == "boxing":
            scores = np.clip(held["alphapose_kp2d"][..., 2], 0, 1)
            marks = PoseSequence(held["alphapose_kp2d"][..., :2], HALPE26, _IMAGE, scores)
            poses = held["motionbert"].astype(float)
            yield from _forms(
                f"{name}, AlphaPose and MotionBERT", found.with_(points=_coco(marks), poses=poses)
            )
    cycling = np.load(data / "lifter/motionbert_wild.npz")["cycling"].astype(float)
    yield "cycling, MotionBERT", Given(np.arange(len(cycling)), None, cycling, words={"fps": 24.0})
    skate = np.load(data / "lifter/mhformer_skating.npz")
    marks = PoseSequence(skate["run_a_kp2d"], H36M17, _IMAGE)
    words = {"image_size": (1280, 720), "fps": 25.0}
    poses = skate["run_a"].astype(float)
    yield from _forms(
        "skating, HRNet and MHFormer", Given(np.arange(len(poses)), _coco(marks), poses, words=words)
    )
    seen = np.load(data / "real/pose2sim/truth.npz")
    for film in sorted((data / "real/pose2sim").glob("*.mp4")):
        points = seen[f"openpose_body25b_{film.stem}"][:, :17].astype(float)
        words = {"fps": 60.0, "image_size": read_video(film).size}
        given = Given(np.arange(len(points)), points, words=words)
        yield f"balancing, OpenPose, {film.stem}", given
        yield f"balancing, OpenPose and lifted, {film.stem}", _lifted(given)


def _forms(name: str, given: Given) -> Iterator[tuple[str, Given]]:
    """Keypoints alone, poses alone, and both."""
    yield f"{name}: both", given
    yield f"{name}: keypoints", given.with_(poses=None, unit="arbitrary")
    yield f"{name}: poses", given.with_(points=None)
