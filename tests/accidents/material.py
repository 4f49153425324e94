"""What accidents are made from: takes as a user gives them, and a run of one without the files that it would write."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from golden.detections import AS_COCO, coco_tracks
from golden.lifts import lift
from pcnet3d.examples.walker import side_camera, walker
from pcnet3d.examples.walker.files import write_video
from pcnet3d.models.lab.evaluation.runs import EVALUATION_SETS
from pcnet3d.models.lab.evaluation.testbed import BEDS, MIN_FRAMES, see
from pcnet3d.models.lab.mocap.clips import data_folder, read_clips
from pcnet3d.pipeline.core.anthropometry import implied_stature
from pcnet3d.pipeline.core.frames import IMAGE as _IMAGE
from pcnet3d.pipeline.core.layouts import COCO17, H36M17, remap
from pcnet3d.pipeline.core.pose import PoseSequence
from pcnet3d.pipeline.core.take import Take
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.pipeline.running.plan import planned

BED = ("07_03", "08_04", "accad-m1_run", "accad-m1_lift-box", "tennis-jangel_Derecha_0")
_WALK_CROP = "lifter/walk_crop.npz"
_MOST = 240  # frames of a take of the test bed
_WRITE = ("record", "export", "report")


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


def seen_take(clip: Any, bed: str, seed: int) -> Given:
    """A clip of motion capture as a camera and a detector see it."""
    take = see(clip, seed, views=BEDS[bed])  # type: ignore[index]
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
    assert given.points is not None
    points = PoseSequence(
        given.points[..., :2], COCO17, _IMAGE, given.points[..., 2], given.frames / 30.0, given.frames
    )
    return given.with_(
        poses=lift(remap(points, H36M17), size, given.words.get("focal")).joints.astype(float), video=None
    )


def honest(count: int) -> Iterator[tuple[str, Given]]:
    """Takes that nothing was done to: the test bed before both kinds of cameras, real clips, files of lifters."""
    data = data_folder()
    crop = _walk_crop()
    yield "walk_crop", crop
    yield "walk_crop poses", _lifted(crop)
    for name in ("boxing", "demo_man"):
        held = np.load(data / f"lifter/{name}.npz")
        points = held["movenet_kp2d"].astype(float)
        words = {"image_size": tuple(int(x) for x in held["image_size"]), "fps": 30.0}
        given = Given(np.arange(len(points)), points, words=words)
        if name == "demo_man":
            given = given.with_(video=data / "video/sports2d_demo.mp4")
        yield name, given
        if name == "boxing":
            yield "boxing, MotionBERT's", given.with_(poses=held["motionbert"].astype(float))
    wild = np.load(data / "lifter/motionbert_wild.npz")
    yield (
        "cycling, MotionBERT's",
        Given(
            np.arange(len(wild["cycling"])),
            None,
            wild["cycling"].astype(float),
            words={"fps": float(wild["fps"][0])},
        ),
    )
    skate = np.load(data / "lifter/mhformer_skating.npz")
    yield (
        "skating, MHFormer's",
        Given(np.arange(291), None, skate["run_a"].astype(float), words={"fps": 25.0}),
    )
    made = 7
    for seed in range(9):
        for bed in BEDS:
            for one in EVALUATION_SETS["val"]:
                for clip in one.clips():
                    if made >= count:
                        return
                    if len(clip) < MIN_FRAMES:
                        continue
                    made += 1
                    given = seen_take(clip, bed, seed)
                    yield f"{clip.name} {bed} {seed}", _lifted(given) if made % 4 == 0 else given
