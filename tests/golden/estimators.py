"""Files of SAM 3D Body, InstantHMR, GEM-X, AlphaPose's 3D model and WHAM (formats.md section 6), of bodies
(T, 17, 3) in CAMERA, metres, or z up where said."""

import json
from collections import defaultdict
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from golden import worlds
from golden.bodies import feet_of, placed
from golden.lifters import box_of
from golden.skeleton import PLACE, Bone, bvh_text, turns
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.layouts import BODY_25, COCO17, FEET, MHR70, SOMA77

AWAY_M = np.array([0.3, 0.1, 4.0])
FOCAL_PX = 1468.6  # the diagonal of 1280 x 720


def mhr70(bodies: np.ndarray) -> np.ndarray:
    """(T, 70, 3) about the pelvis."""
    return placed(bodies, MHR70.joints)


def sam3d(bodies: np.ndarray, person: int = 0) -> list[dict]:
    """A frame's dict each, as process_one_image returns them for one person."""
    keypoints = mhr70(bodies).astype(np.float32)
    away = (AWAY_M + np.array([2.0 * person, 0, 0])).astype(np.float32)
    return [
        {
            "bbox": np.array(box_of(person, frame), np.float32),
            "focal_length": np.float32(FOCAL_PX),
            "pred_keypoints_3d": row,
            "pred_vertices": np.zeros((9, 3), np.float32),
            "pred_cam_t": away,
            "mask": None,
        }
        for frame, row in enumerate(keypoints)
    ]


def sam3d_stacked(folder: Path, bodies: np.ndarray) -> Path:
    """<video>_mhr_outputs.npz of one person."""
    rows = sam3d(bodies)
    arrays = {key: np.stack([row[key] for row in rows]) for key in rows[0] if key != "mask"}
    path = folder / "walk_mhr_outputs.npz"
    meta = np.array([{"fps": 25.0}], dtype=object)
    np.savez_compressed(path, **arrays, frame_indices=np.arange(len(rows), dtype=np.int32), meta=meta)
    return path


def sam3d_folder(folder: Path, people: list[np.ndarray]) -> Path:
    """An .npz a frame whose Python objects are the list of dicts."""
    folder = folder / "walk_npz"
    folder.mkdir()
    for frame, dicts in enumerate(zip(*map(sam3d, people, range(len(people))), strict=True)):
        np.savez_compressed(folder / f"frame_{frame:06d}.npz", outputs=np.array(dicts, dtype=object))
    return folder


def sam3d_json(folder: Path, people: list[np.ndarray]) -> Path:
    """A list with the list of dicts of each frame."""
    frames = [
        [{key: np.asarray(value).tolist() for key, value in person.items()} for person in dicts]
        for dicts in zip(*map(sam3d, people, range(len(people))), strict=True)
    ]
    path = folder / "walk.json"
    path.write_text(json.dumps(frames))
    return path


def instanthmr(folder: Path, people: list[np.ndarray]) -> Path:
    """The network's outputs, stacked to (T, P, 70, 3), of people who are found now and then."""
    joints = np.stack([mhr70(bodies) for bodies in people], axis=1).astype(np.float32)
    trans = np.broadcast_to(AWAY_M + np.arange(len(people))[:, None] * [2.0, 0, 0], (*joints.shape[:2], 3))
    joints[5:8, 1] = np.nan
    np.savez(folder / "instanthmr.npz", joints_3d=joints, cam_trans=trans.astype(np.float32))
    return folder / "instanthmr.npz"


def soma(folder: Path, world: np.ndarray) -> Path:
    """Kimodo's .npz of somaskel77, of bodies z up."""
    joints = worlds.y_up(placed(world, SOMA77.joints)).astype(np.float32)
    still = np.tile(np.eye(3, dtype=np.float32), (*joints.shape[:2], 1, 1))
    path = folder / "motion_00.npz"
    np.savez(
        path, posed_joints=joints, global_rot_mats=still, local_rot_mats=still, root_positions=joints[:, 0],
        foot_contacts=np.zeros((len(joints), 4)),
    )  # fmt: skip
    return path


# The names of SOMA's bones in GEM-X's BVH, their parents and the joints of ours that they are.
SOMA_BONES = {
    "Root": (None, None), "Hips": ("Root", "pelvis"), "Spine1": ("Hips", "spine"), "Chest": ("Spine1", "spine"),
    "Neck1": ("Chest", "thorax"), "Neck2": ("Neck1", "thorax"), "Head": ("Neck2", "thorax"),
    "HeadEnd": ("Head", "head"), "LeftEye": ("Head", "nose"), "RightEye": ("Head", "nose"),
    **{f"{side}{name}": (f"{side}{parent}" if parent not in ("Hips", "Chest") else parent, f"{side[0].lower()}_{ours}")
       for side in ("Left", "Right") for name, parent, ours in (
        ("Leg", "Hips", "hip"), ("Shin", "Leg", "knee"), ("Foot", "Shin", "ankle"), ("ToeBase", "Foot", "ankle"),
        ("Shoulder", "Chest", "shoulder"), ("Arm", "Shoulder", "shoulder"), ("ForeArm", "Arm", "elbow"),
        ("Hand", "ForeArm", "wrist"))},
}  # fmt: skip


def gemx_bvh(folder: Path, world: np.ndarray) -> Path:
    """<video>_animated_skeleton.bvh of GEM-X, of bodies z up: each bone's channels and offset are in its parent's axes,
    which lie anyhow."""
    places = {
        name: 100 * worlds.y_up(world)[:, H36M17.index(ours)] if ours else np.zeros((len(world), 3))
        for name, (_, ours) in SOMA_BONES.items()
    }
    axes = dict(
        zip(
            SOMA_BONES,
            Rotation.from_quat(np.random.default_rng(0).normal(size=(len(SOMA_BONES), 4))),
            strict=True,
        )
    )
    axes["Root"] = Rotation.identity()
    bones = {}
    for name, (parent, _) in SOMA_BONES.items():
        here = axes[parent].inv() if parent else Rotation.identity()
        offsets = here.apply(places[name] - (places[parent] if parent else 0))
        turned = np.tile((here * axes[name]).as_euler("ZYX", degrees=True), (len(world), 1))
        values = np.concatenate([offsets, turned], axis=1)
        bones[name] = Bone(parent, offsets[0], f"{PLACE} {turns('ZYX')}", values)
    path = folder / "walk_animated_skeleton.bvh"
    path.write_text(bvh_text(bones, 1 / 30, end="0.0 0.0 0.0"))
    return path


ALPHAPOSE_UNIT_M = 2.0


def alphapose3d(folder: Path, people: list[np.ndarray]) -> Path:
    """alphapose-results.json of the SMPL model: 29 keypoints, and 24 joints about the pelvis in units of 2 m."""
    listed = []
    for frame in range(len(people[0])):
        for person, bodies in enumerate(people):
            joints = worlds.smpl(bodies[frame : frame + 1])[0] / ALPHAPOSE_UNIT_M
            left, top, right, bottom = box_of(person, frame)
            listed.append(
                {
                    "image_id": f"{frame}.jpg", "category_id": 1, "keypoints": [200.5, 100.0, 0.9] * 29, "score": 2.7,
                    "box": [left, top, right - left, bottom - top], "idx": person + 1,
                    "pred_xyz_jts": (joints - joints[0]).tolist(),
                }
            )  # fmt: skip
    path = folder / "alphapose-results.json"
    path.write_text(json.dumps(listed))
    return path


_VERTICES = 6890
REGRESSOR = "J_regressor.npy"


def regressor(folder: Path) -> Path:
    """SMPL's regressor of 24 joints as an array, beside the results; each joint is one vertex of no other meaning."""
    rows = np.zeros((24, _VERTICES), np.float32)
    rows[np.arange(24), 100 + np.arange(24)] = 1
    np.save(folder / REGRESSOR, rows)
    return folder / REGRESSOR


def wham_people(people: list[np.ndarray]) -> dict:
    """wham_output.pkl's dict of subjects, meshes of points that matter and 0 elsewhere; the second from frame 10 on."""
    face = {332: "nose", 6260: "nose", 2800: "nose", 4071: "head", 583: "head"}
    feet = {
        3216: "l_big_toe",
        3226: "l_small_toe",
        3387: "l_heel",
        6617: "r_big_toe",
        6624: "r_small_toe",
        6787: "r_heel",
    }
    subjects: dict = defaultdict(dict)
    for person, bodies in enumerate(people):
        mesh = np.zeros((len(bodies), _VERTICES, 3), np.float32)
        mesh[:, 100:124] = worlds.smpl(bodies)
        for vertex, joint in face.items():
            mesh[:, vertex] = bodies[:, H36M17.index(joint)]
        for vertex, point in feet.items():
            mesh[:, vertex] = feet_of(bodies)[:, FEET.index(point)]
        still = np.zeros((len(bodies), 72), np.float32)
        subjects[person] = {
            "pose": still, "trans": still[:, :3], "pose_world": still, "trans_world": still[:, :3],
            "betas": still[:, :10], "verts": mesh + np.float32(AWAY_M),
            "frame_ids": np.arange(len(bodies)) + 10 * person,
        }  # fmt: skip
    return subjects


def sam3d_csv(folder: Path, bodies: np.ndarray) -> Path:
    """SAM3DBody-cpp's table of one person."""
    sides, ends = {"l": "left", "r": "right"}, {"toe": "toe_tip"}
    ends |= {number: f"{number}_joint" for number in ("first", "second", "third")}
    names = [
        "_".join({**sides, **ends}.get(word, word) for word in joint.split("_")) for joint in MHR70.joints
    ]
    lines = [",".join(f"{name}_3D{axis}" for name in names for axis in "XYZ")]
    lines += [",".join(f"{value:f}" for value in row.ravel()) for row in mhr70(bodies)]
    (folder / "pose.csv").write_text("\n".join(lines) + "\n")
    return folder / "pose.csv"


def vibe_people(people: list[np.ndarray]) -> dict:
    """vibe_output.pkl's dict of subjects: SPIN's 49 joints, OpenPose's 25 first."""
    return {
        person: {
            "pred_cam": np.zeros((len(bodies), 3), np.float32),
            "verts": None,
            "pose": np.zeros((len(bodies), 72), np.float32),
            "joints3d": np.concatenate(
                [placed(bodies, BODY_25.joints), np.zeros((len(bodies), 24, 3))], axis=1
            ).astype(np.float32),
            "frame_ids": np.arange(len(bodies)),
        }
        for person, bodies in enumerate(people, 1)
    }


def easymocap3d(folder: Path, world: np.ndarray) -> Path:
    """EasyMocap's keypoints3d of one person, of bodies z up; a wrist is lost at times."""
    folder = folder / "keypoints3d"
    folder.mkdir()
    scored = np.concatenate([placed(world, BODY_25.joints), np.full((len(world), 25, 1), 0.9)], axis=-1)
    scored[:, 0, 3] = 0.7
    scored[7, BODY_25.index("l_wrist")] = 0
    for frame, row in enumerate(scored.round(5).tolist()):
        (folder / f"{frame:06d}.json").write_text(
            json.dumps([{"id": 0, "keypoints3d": row}]), encoding="utf-8"
        )
    return folder


_ARM = ("clavicle", "shoulder", "elbow", "wrist", "hand", "handtip", "thumb")
KINECT = [
    "PELVIS", "SPINE_NAVEL", "SPINE_CHEST", "NECK",
    *(f"{part}_{side}".upper() for side in ("left", "right") for part in _ARM),
    *(f"{part}_{side}".upper() for side in ("left", "right") for part in ("hip", "knee", "ankle", "foot")),
    "HEAD", "NOSE", "EYE_LEFT", "EAR_LEFT", "EYE_RIGHT", "EAR_RIGHT",
]  # fmt: skip


def _of_kinect(bodies: np.ndarray, names: list[str]) -> np.ndarray:
    """Of names such as ELBOW_LEFT, left_ear and SPINE_NAVEL."""
    plain = []
    for name in names:
        words = name.lower().split("_")
        sides = [f"{word[0]}_" for word in words if word in ("left", "right")]
        plain.append("".join([*sides, next(word for word in words if word not in ("left", "right"))]))
    return placed(bodies, plain)


def azure_kinect(folder: Path, people: list[np.ndarray]) -> Path:
    """JSON of offline_processor, millimetres in the depth camera's axes."""
    bodies = [_of_kinect(1000 * (body + AWAY_M), KINECT).round(3).tolist() for body in people]
    frames = [
        {
            "frame_id": frame, "timestamp_usec": 33333 * frame, "num_bodies": len(people),
            "bodies": [
                {"body_id": number, "joint_positions": joints[frame],
                 "joint_orientations": [[1, 0, 0, 0]] * len(KINECT)}
                for number, joints in enumerate(bodies, 1)
            ],
        }
        for frame in range(len(people[0]))
    ]  # fmt: skip
    content = {"bone_list": [["NECK", "HEAD"]], "frames": frames, "joint_names": KINECT}
    (folder / "walk.json").write_text(json.dumps(content), encoding="utf-8")
    return folder / "walk.json"


def zed(folder: Path, people: list[np.ndarray]) -> Path:
    """The ZED SDK's bodies of 34 joints, metres, y down."""
    names = [
        "pelvis",
        "spine",
        "chest",
        "neck",
        *(f"{side}_{part}" for side in ("left", "right") for part in _ARM),
    ]
    names += [f"{side}_{part}" for side in ("left", "right") for part in ("hip", "knee", "ankle", "foot")]
    names += ["head", "nose", "left_eye", "left_ear", "right_eye", "right_ear", "left_heel", "right_heel"]
    frames = [
        {
            "timestamp": 1_700_000_000_000_000_000 + 33_333_333 * frame,
            "body_list": [
                {"id": number, "keypoint": _of_kinect(bodies[frame : frame + 1] + AWAY_M, names)[0].tolist()}
                for number, bodies in enumerate(people)
            ],
        }
        for frame in range(len(people[0]))
    ]
    (folder / "bodies.json").write_text(json.dumps(frames), encoding="utf-8")
    return folder / "bodies.json"


def movid_people(people: list[np.ndarray]) -> dict:
    """WHAM's dict with MoViD's joints in it, 31 of them, about the hips' middle."""
    subjects = wham_people(people)
    for bodies, held in zip(people, subjects.values(), strict=True):
        hips = bodies[:, H36M17.indices(("l_hip", "r_hip"))].mean(axis=1)
        joints = placed(bodies, COCO17.joints) - hips[:, None]
        held["joints3d"] = np.concatenate([joints, joints[:, :14]], axis=1).astype(np.float32)
        held["trans_cam"] = (hips + AWAY_M).astype(np.float32)
    return subjects
