"""A golden file of every registered adapter, in its upstream's exact layout; several where a format has several forms.

A person is there for at least 20 frames; a format that can hold several people holds two.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from golden import detections, estimators, films, landmarks, lifters, phalp, sensors, worlds
from golden.bodies import BODY_AND_FEET, Person, placed, with_feet
from golden.strapped import strapped
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.layouts import BODY_25, BODY_25B, COCO17, HALPE26, MHR70, OPENPOSE18, Layout
from pcnet3d.pipeline.reading.load import adapters

FRAMES = 40
AWAY_M = np.array([0.3, 0.1, 4.0])


@dataclass(frozen=True)
class Golden:
    """write(person, folder) -> the file or folder; options: what the adapter needs to be told to read it.

    form: what the documents call the file. by_name: the adapter recognises nothing by content.
    """

    adapter: str
    form: str
    write: Callable[[Person, Path], Path]
    options: dict[str, Any] = field(default_factory=dict)
    by_name: bool = False


def recognised(path: Path) -> list[str]:
    """The adapters that take the file for one of theirs."""
    return [name for name, each in adapters().items() if each.sniff(path)]


def _npy(made: Callable[[np.ndarray], np.ndarray], frames: int, person: Person, folder: Path) -> Path:
    """made: what is saved, of bodies (frames, 17, 3)."""
    np.save(folder / "poses.npy", made(person.turning(frames)).astype(np.float32))
    return folder / "poses.npy"


def _mmpose3d(form: str, person: Person, folder: Path) -> Path:
    """Two people; only the first of them has a foot lower than the other."""
    frames = [
        [
            lifters.instance(lifters.as_mmpose(body), lifters.box_of(number, i))
            for number, body in enumerate(bodies)
        ]
        for i, bodies in enumerate(zip(*_two_turning(person), strict=True))
    ]
    return lifters.mmpose3d(folder, frames, form)


def _openpose3d(person: Person, folder: Path, layout: Layout = BODY_25) -> Path:
    bodies = placed(person.turning(FRAMES) + AWAY_M, layout.joints)
    return lifters.openpose3d(folder, [[body, body + np.array([2.0, 0, 0])] for body in bodies])


def _mediapipe(write: Callable, person: Person, folder: Path) -> Path:
    return write(folder, landmarks.landmarks(person.turning(FRAMES)))


def _tasks_json(person: Person, folder: Path) -> Path:
    return landmarks.tasks_json(folder, *map(landmarks.landmarks, _two_turning(person)))


def _phalp(person: Person, folder: Path) -> Path:
    return _pickle(folder / "demo_walk.pkl", phalp.tracks(person.turning(60)))


def _pickle(path: Path, content: dict) -> Path:
    path.write_bytes(phalp.as_joblib(content))
    return path


def _markers(person: Person) -> np.ndarray:
    return person.standing(FRAMES)[:, H36M17.indices(list(worlds.POSE2SIM.values()))]


def _trc(person: Person, folder: Path) -> Path:
    return worlds.trc(folder / "walk_0-39.trc", worlds.POSE2SIM, worlds.y_up(_markers(person)))


def _c3d(person: Person, folder: Path) -> Path:
    return worlds.c3d(folder / "walk.c3d", worlds.POSE2SIM, 1000 * _markers(person))


def _bvh(program: str, person: Person, folder: Path) -> Path:
    return worlds.rig(program, folder / "walk.bvh", worlds.y_up(person.standing(FRAMES)))


def _opencap(person: Person, folder: Path) -> Path:
    joints = with_feet(person.standing(FRAMES))[:, BODY_AND_FEET.indices([*worlds.OPENCAP.values()])]
    return worlds.trc(folder / "walk1.trc", worlds.OPENCAP, worlds.y_up(joints))


def _amass(person: Person, folder: Path) -> Path:
    parameters = {"poses": np.zeros((FRAMES, 156)), "trans": np.zeros((FRAMES, 3)), "betas": np.zeros(16)}
    path = folder / "walk_poses.npz"
    np.savez(
        path, joints=worlds.smpl(person.standing(FRAMES)), **parameters, mocap_framerate=120.0, gender="male"
    )
    return path


def _freemocap(made: Callable[[np.ndarray], np.ndarray], name: str, person: Person, folder: Path) -> Path:
    np.save(folder / name, made(person.standing(FRAMES)))
    return folder / name


def _with_hands_and_face(world: np.ndarray) -> np.ndarray:
    body = worlds.freemocap(world)
    return np.concatenate([body, np.repeat(body[:, :1], 2 * 21 + 478, axis=1)], axis=1)


def _freemocap_csv(person: Person, folder: Path) -> Path:
    return worlds.freemocap_csv(folder, worlds.freemocap_rtmpose(person.standing(FRAMES)))


def _two_turning(person: Person) -> list[np.ndarray]:
    return [person.turning(FRAMES), person.turning(FRAMES + 200)[200:]]


def _one(write: Callable, person: Person, folder: Path) -> Path:
    return write(folder, person.turning(FRAMES))


def _people(write: Callable, person: Person, folder: Path) -> Path:
    return write(folder, _two_turning(person))


def _world(write: Callable, person: Person, folder: Path) -> Path:
    return write(folder, person.standing(FRAMES))


def _wham(person: Person, folder: Path) -> Path:
    estimators.regressor(folder)
    return _pickle(folder / "wham_output.pkl", estimators.wham_people(_two_turning(person)))


def _detections(form: str, layout: Layout, person: Person, folder: Path) -> Path:
    return detections.WRITERS[form](folder, person.two_in_images(layout))


def _openpose_25b(person: Person, folder: Path) -> Path:
    """Bodies as long as those of a person, by which alone BODY_25B is told from BODY_25."""
    scene = {}
    for name, bodies in enumerate(_two_turning(person)):
        joints = 200 * placed(bodies, BODY_25B.joints)[..., :2] + [400 + 500 * name, 300]
        scores = np.broadcast_to(np.linspace(0.3, 0.9, len(BODY_25B)), joints.shape[:2])
        scene[str(name)] = np.arange(FRAMES), np.concatenate([joints, scores[..., None]], axis=-1)
    return detections.openpose(folder, scene)


def _whole_body(person: Person, folder: Path) -> Path:
    """Halpe's 136 joints, of which the first are the body."""
    scene = person.two_in_images(HALPE26)
    return detections.alphapose(
        folder,
        {name: (frames, points[:, [*range(26), *[0] * 110]]) for name, (frames, points) in scene.items()},
    )


def _alphapose_dict(form: str, person: Person, folder: Path) -> Path:
    scene = person.two_in_images(OPENPOSE18)
    between = {name: detections.between_shoulders(points) for name, points in scene.items()}
    return detections.WRITERS[form](folder, between)


def _imu_csv(person: Person, folder: Path) -> Path:
    sensors.write_csv(folder / "wrist.csv", strapped(walker(fps=60, seconds=3), "r_forearm"))
    return folder / "wrist.csv"


def _pickled(made: Callable[[list[np.ndarray]], dict], person: Person, folder: Path) -> Path:
    return _pickle(folder / "output.pkl", made(_two_turning(person)))


CATALOGUE = (
    Golden("alphapose3d", "`alphapose-results.json` of its SMPL model", partial(_people, estimators.alphapose3d)),
    Golden("amass", "`*_poses.npz` with joints", _amass),
    Golden("array2d", "rtmlib's `keypoints` and `scores` in an `.npz`", partial(_detections, "rtmlib", COCO17)),
    Golden("array2d", "`.npy` of (frames, 17, 3): x, y, score", partial(_detections, "array2d", COCO17)),
    Golden("array2d", "the same of OpenPose's 137", partial(_detections, "openpose137", BODY_25)),
    Golden("arrays", "`.npy` of (frames, 17, 3), of no known lifter", partial(_npy, lifters.smoothed, 300)),
    Golden(
        "arrays", "any `.npy`, here in metres", partial(_npy, np.asarray, FRAMES),
        {"layout": "H36M17", "frame": "CAMERA", "unit": "m"}, by_name=True,
    ),
    *(Golden("bvh", f"{program}'s `*.bvh`", partial(_bvh, program)) for program in worlds.RIGS),
    Golden("bvh", "GEM-X's `<video>_animated_skeleton.bvh`", partial(_world, estimators.gemx_bvh)),
    Golden("c3d", "`*.c3d` in millimetres", _c3d),
    Golden("ddhpose", "`.npy` of clips", partial(_npy, lifters.in_clips, 300), {"frames": 300}),
    Golden(
        "ddhpose", "D3DP's `test_3d_<video>_output.npy`",
        partial(_npy, partial(lifters.with_steps_and_proposals, steps=2, proposals=5), 300),
    ),
    Golden("detectron", "VideoPose3D's `<video>.npz`", partial(_detections, "detectron", COCO17)),
    Golden(
        "freemocap", "`mediapipe_body_3d_xyz.npy`",
        partial(_freemocap, worlds.freemocap, "mediapipe_body_3d_xyz.npy"),
    ),
    Golden(
        "freemocap", "`mediaPipeSkel_3d_body_hands_face.npy`",
        partial(_freemocap, _with_hands_and_face, "mediaPipeSkel.npy"),
    ),
    Golden(
        "freemocap", "v2's `rtmpose_body_3d_xyz.npy`",
        partial(_freemocap, worlds.freemocap_rtmpose, "rtmpose_body_3d_xyz.npy"),
    ),
    Golden("freemocap", "v2's `freemocap_data_by_frame.csv`", _freemocap_csv),
    Golden("imu_csv", "a table with time_s", _imu_csv),
    Golden("json2d", "AlphaPose's `alphapose-results.json`", partial(_detections, "alphapose", HALPE26)),
    Golden("json2d", "the same of a whole-body model", _whole_body),
    Golden("json2d", "AlphaPose's `--format cmu`", partial(_alphapose_dict, "alphapose_cmu")),
    Golden("json2d", "AlphaPose's `--format open`", partial(_alphapose_dict, "alphapose_open")),
    Golden("json2d", "COCO's results, a list", partial(_detections, "coco_results", COCO17)),
    Golden("json2d", "COCO's results with track_id", partial(_detections, "coco_tracks", COCO17)),
    Golden("json2d", "COCO's annotations, a dict", partial(_detections, "coco_annotations", COCO17)),
    Golden("json2d", "MMPose inferencer's `<video>.json`", partial(_detections, "mmpose_inferencer", COCO17)),
    Golden("json2d", "MMPose demo's `results_<video>.json`", partial(_detections, "mmpose_demo", COCO17)),
    Golden("json2d", "MMPose inferencer's folder of an image each", partial(_detections, "mmpose_images", COCO17)),
    Golden("json2d", "Sapiens' folder of 308 joints", partial(_detections, "sapiens", MHR70)),
    Golden(
        "json2d", "OpenPose's folder of `*_keypoints.json` or `cam01.0000.json`",
        partial(_detections, "openpose", BODY_25),
    ),
    Golden("json2d", "the same of BODY_25B", _openpose_25b),
    Golden("json2d", "Pose2Sim's and Sports2D's `<video>_json`", partial(_detections, "openpose", HALPE26)),
    Golden("json2d", "Ultralytics' JSON of `to_json`", partial(_detections, "ultralytics", COCO17)),
    Golden("json2d", "JSON of MoveNet in TF.js", partial(_detections, "tfjs", COCO17)),
    Golden("json2d", "JSON of PoseNet in TF.js", partial(_detections, "posenet", COCO17)),
    Golden("json2d", "the same of ml5", partial(_detections, "ml5", COCO17)),
    Golden("json2d", "OpenPifPaf's JSON of a video", partial(_detections, "openpifpaf", COCO17)),
    Golden("json2d", "folder of OpenPifPaf's `*.predictions.json`", partial(_detections, "openpifpaf_images", COCO17)),
    Golden("json2d", "EasyMocap's folder of annots", partial(_detections, "easymocap", BODY_25)),
    Golden("json3d", "EasyMocap's folder of keypoints3d", partial(_world, estimators.easymocap3d)),
    Golden("json3d", "Azure Kinect's JSON (offline_processor)", partial(_people, estimators.azure_kinect)),
    Golden("json3d", "ZED's bodies", partial(_people, estimators.zed)),
    Golden("json3d", "OpenPose's folder of `*_keypoints.json` or `cam01.0000.json`, 3D", _openpose3d),
    Golden("json3d", "the same of BODY_25B", partial(_openpose3d, layout=BODY_25B)),
    Golden("keypoints", "`keypoints.npz`", partial(_detections, "keypoints", COCO17)),
    Golden("mediapipe", "CSV, numbered columns", partial(_mediapipe, landmarks.wide)),
    Golden("mediapipe", "CSV, a row a landmark", partial(_mediapipe, landmarks.long)),
    Golden("mediapipe", "JSON of the Tasks API", _tasks_json),
    Golden("mediapipe", "JSON, bare lists", partial(_mediapipe, landmarks.bare_json)),
    Golden("mediapipe", "BlazePose of TF.js", partial(_mediapipe, landmarks.tfjs)),
    Golden("mediapipe", "`.npy` of (frames, 33, 3 or 4)", partial(_npy, landmarks.landmarks, FRAMES)),
    Golden("mhr70", "CSV of SAM3DBody-cpp", partial(_one, estimators.sam3d_csv)),
    Golden("mhr70", "`.npz` of SAM 3D Body's arrays", partial(_one, estimators.sam3d_stacked)),
    Golden("mhr70", "folder of `.npz` with SAM 3D Body's dicts", partial(_people, estimators.sam3d_folder)),
    Golden("mhr70", "JSON of SAM 3D Body's dicts", partial(_people, estimators.sam3d_json)),
    Golden("mhr70", "`.npz` of InstantHMR's arrays", partial(_people, estimators.instanthmr)),
    Golden("mmpose3d", "inferencer's `<video>.json`", partial(_mmpose3d, "inferencer")),
    Golden("mmpose3d", "demo's `results_<video>.json`", partial(_mmpose3d, "demo")),
    Golden("mmpose3d", "RTMW3D's `results_<video>.json`", partial(_people, lifters.rtmw3d)),
    Golden("motionbert", "`X3D.npy`", partial(_npy, lifters.x3d, 300)),
    Golden("phalp", "`demo_<video>.pkl`", _phalp),
    Golden("soma", "Kimodo's `.npz`", partial(_world, estimators.soma)),
    Golden("table2d", "DeepLabCut's CSV", partial(_detections, "deeplabcut", COCO17)),
    Golden("table2d", "SLEAP's CSV", partial(_detections, "sleap", COCO17)),
    Golden("table2d", "CSV, a column for each coordinate", partial(_detections, "columns", COCO17)),
    Golden("table3d", "anipose's CSV", partial(_world, worlds.anipose)),
    Golden("trc", "OpenCap's `<trial>.trc`: no head", _opencap),
    Golden("trc", "Pose2Sim's `<take>_<frames>.trc`", _trc),
    Golden(
        "ultralytics", "folder of `save_txt`",
        partial(_detections, "ultralytics_texts", COCO17), {"image_size": detections.IMAGE_SIZE},
    ),
    Golden("video", "`*.mp4`", lambda _, folder: films.film(folder / "walk.mp4", range(0, 800, 40))),
    Golden(
        "videopose2d", "`data_2d_custom_<name>.npz`",
        partial(_detections, "videopose2d", COCO17), {"video": "0"},
    ),
    Golden("videopose3d", "`.npy` of `--viz-export`", partial(_npy, lifters.viz_export, FRAMES)),
    Golden("videopose3d", "folder of a vis.py", partial(_one, lifters.vis_folder)),
    Golden("vis2d", "`input_2D/keypoints.npz`", partial(_detections, "vis2d", H36M17)),
    Golden("vis2d", "the same with scores", partial(_detections, "vis2d_scores", H36M17)),
    Golden("wham", "MoViD's `.pkl`", partial(_pickled, estimators.movid_people)),
    Golden("wham", "VIBE's `vibe_output.pkl`", partial(_pickled, estimators.vibe_people)),
    Golden("wham", "`wham_output.pkl`", _wham, {"regressor": estimators.REGRESSOR}),
)  # fmt: skip
