"""3D files of lifters in their camera's axes (formats.md sections 2 to 4), of bodies (T, 17, 3) in CAMERA, metres."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from golden.bodies import placed
from pcnet3d.pipeline import rotate
from pcnet3d.pipeline.core.layouts import COCO23

CLIP = 243


def in_clips(video: np.ndarray) -> np.ndarray:
    """(b, 243, ...) from (T, ...) as UnchunkedGenerator_Seq cuts: the last clip is the video's last 243 frames;
    a video shorter than a clip is filled up on the right with its last frame."""
    frames = len(video)
    if frames < CLIP:
        return np.concatenate([video, np.repeat(video[-1:], CLIP - frames, axis=0)])[None]
    starts = [*range(0, frames - CLIP, CLIP), frames - CLIP]
    return np.stack([video[start : start + CLIP] for start in starts])


def with_steps_and_proposals(video: np.ndarray, steps: int, proposals: int) -> np.ndarray:
    """(t, h, T, 17, 3): proposals of the last step lie symmetrically around the video, other steps are far off."""
    spread = 0.01 * (np.arange(proposals) - (proposals - 1) / 2)
    stack = video[None, None] + spread[None, :, None, None, None]
    stack = np.repeat(stack, steps, axis=0)
    stack[:-1] *= 1.2
    stack[..., :1, :] = 0
    return stack


QUATERNION_XYZW = [-0.1500701755, -0.7552407980, 0.6223280430, 0.1407056451]


def displayed(camera: np.ndarray, each_frame: bool = False) -> np.ndarray:
    turned = rotate(Rotation.from_quat(QUATERNION_XYZW).as_matrix(), camera)
    turned[..., 2] -= turned[..., 2].min(axis=-1, keepdims=True) if each_frame else turned[..., 2].min()
    return turned.astype(np.float32)


def as_mmpose(camera: np.ndarray, rebase: bool = True) -> np.ndarray:
    """Camera axes to what pose3d_inferencer.py writes: y and z exchanged, then the new x and z negated."""
    joints = camera[..., [0, 2, 1]] * [-1, 1, -1]
    if rebase:
        joints[..., 2] -= joints[..., 2].min(axis=-1, keepdims=True)
    return joints


def instance(joints: np.ndarray, box: list[float] | None, score: float = 1.0) -> dict:
    person = {"keypoints": joints.tolist(), "keypoint_scores": [score] * len(joints)}
    return person if box is None else person | {"bbox": [box], "bbox_score": 0.9}


def box_of(person: int, frame: int) -> list[float]:
    left = 100.0 + 400 * person + frame
    return [left, 50.0, left + 120, 400.0]


def x3d(bodies: np.ndarray) -> np.ndarray:
    """MotionBERT's X3D.npy: the pelvis moves, and its depth is 0 in the first frame of each clip of 243."""
    time = np.arange(len(bodies))
    root = [0.3 * np.cos(time / 50) + 0.2, 0.05 * np.sin(time / 20) - 0.1, 0.001 * (time % CLIP)]
    return (bodies + np.stack(root, axis=-1)[:, None]).astype(np.float32)


def smoothed(bodies: np.ndarray) -> np.ndarray:
    """X3D.npy after somebody's filter over time, which leaves no exact zero."""
    from scipy.ndimage import gaussian_filter1d

    return gaussian_filter1d(x3d(bodies), 2, axis=0)


def viz_export(bodies: np.ndarray) -> np.ndarray:
    """What VideoPose3D's run.py --viz-export saves: the pelvis near 0, but not at it."""
    drift = 0.004 * np.cos(np.arange(len(bodies))[:, None, None] + [0, 1, 2])
    return (bodies + drift).astype(np.float32)


def vis_folder(folder: Path, bodies: np.ndarray) -> Path:
    """The folder of a vis.py: 2D input and 3D output, both under the key `reconstruction`."""
    for part in ("input_2D", "output_3D"):
        (folder / "skating" / part).mkdir(parents=True)
    keypoints = np.full((1, len(bodies), 17, 2), 300.0)
    np.savez_compressed(folder / "skating" / "input_2D" / "keypoints.npz", reconstruction=keypoints)
    output = folder / "skating" / "output_3D" / "output_keypoints_3d.npz"
    np.savez_compressed(output, reconstruction=bodies.astype(np.float32))
    return folder / "skating"


def mmpose3d(folder: Path, frames: list[list[dict]], form: str = "inferencer") -> Path:
    """frames: each frame's instances; form: of the "inferencer", frames from 0, or of the "demo", from 1."""
    first = {"inferencer": 0, "demo": 1}[form]
    listed = [{"frame_id": i + first, "instances": people} for i, people in enumerate(frames)]
    meta = {"dataset_name": "h36m", "keypoint_colors": {"__ndarray__": [[255, 0, 0]] * 300, "dtype": "uint8"}}
    path = folder / ("walk.json" if form == "inferencer" else "results_walk.json")
    path.write_text(json.dumps({"meta_info": meta, "instance_info": listed} if form == "demo" else listed))
    return path


def openpose3d(folder: Path, frames: list[list[np.ndarray]], name: str = "pose_keypoints_3d") -> Path:
    """frames: each frame's people, (J, 3) each; a joint of NaN was not found."""
    folder = folder / "json"
    folder.mkdir()
    for i, bodies in enumerate(frames):
        people = []
        for body in bodies:
            found = np.isfinite(body).all(axis=1)
            points = np.column_stack([np.nan_to_num(body), np.ones(len(body))]) * found[:, None]
            flat = [value for x, y, *_ in points.tolist() for value in (300 + x, 200 + y, 0.8)]
            people.append({"person_id": [-1], "pose_keypoints_2d": flat, name: points.ravel().tolist()})
        text = json.dumps({"version": 1.3, "people": people})
        (folder / f"walk_{i:012d}_keypoints.json").write_text(text)
    return folder


def rtmw3d(
    folder: Path,
    people: list[np.ndarray],
    change: Callable[[np.ndarray], np.ndarray] = lambda crop: crop,
) -> Path:
    """results_walk.json of RTMW3D's demo, of bodies (T, 17, 3) each, after change(crop coordinates (T, 133, 3))."""
    written = []
    for bodies in people:
        crop = -change(_rtmw3d_crop(bodies))[..., [0, 2, 1]]
        crop[..., 2] -= crop[..., 2].min(axis=1, keepdims=True)
        written.append(crop)
    scores = [0.6 + 0.05 * (j % 17) for j in range(133)]
    frames = [
        {
            "frame_id": i + 1,
            "instances": [
                {"keypoints": row.tolist(), "keypoint_scores": scores, "bbox": box_of(person, i)}
                for person, row in enumerate(rows)
            ],
        }
        for i, rows in enumerate(zip(*written, strict=True))
    ]
    path = folder / "results_walk.json"
    path.write_text(json.dumps({"meta_info": {"dataset_name": "coco_wholebody"}, "instance_info": frames}))
    return path


def _rtmw3d_crop(bodies: np.ndarray) -> np.ndarray:
    """(T, 133, 3): pixels and depth bins of the crop."""
    whole = placed(bodies, [*COCO23.joints, *["nose"] * (133 - len(COCO23))])
    crop = np.empty_like(whole)
    crop[..., :2] = whole[..., :2] * 170 + [144, 190]
    crop[..., 2] = (whole[..., 2] / 2.1744869 + 1) * 144
    return crop
