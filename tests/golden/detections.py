"""2D files in every documented form, written from one kind of scene: {person: (frames, points (T, J, 3))}."""

import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from pcnet3d.pipeline.core.layouts import COCO17, H36M17, OPENPOSE18
from pcnet3d.pipeline.files.detections import KEYPOINTS, Detections

# Rows of H36M17 in COCO's order; eyes and ears lie where the nose is.
AS_COCO = [H36M17.index(joint if joint in H36M17 else "nose") for joint in COCO17.joints]
Scene = dict[str, tuple[np.ndarray, np.ndarray]]


def moving(joints: int, frames=range(12), number: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Frames and points of a person who drifts to the right; people of other numbers stand far away."""
    t, j = np.array(frames)[:, None], np.arange(joints)
    x = 100.25 + 400 * number + 5 * j + 2 * t
    y = 80.5 + 9 * j + 0.5 * t
    return t[:, 0], np.stack([x, y, np.broadcast_to((j + 2) / (joints + 4), x.shape)], axis=-1)


def between_shoulders(person: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The same person of OPENPOSE18 with the neck in the middle of the shoulders, where AlphaPose puts it."""
    frames, points = person
    shoulders = points[:, OPENPOSE18.indices(["l_shoulder", "r_shoulder"]), :2]
    points[:, OPENPOSE18.index("neck"), :2] = shoulders.mean(axis=1)
    return frames, points


def _rows(scene: Scene) -> list[tuple[int, str, np.ndarray]]:
    rows = [
        (int(frame), person, row)
        for person, (frames, points) in scene.items()
        for frame, row in zip(frames, points, strict=True)
    ]
    return sorted(rows, key=lambda row: row[0])


def _frames(scene: Scene) -> list[tuple[int, list[tuple[str, np.ndarray]]]]:
    """Every frame up to the last, with the people in it and their points."""
    rows = _rows(scene)
    return [
        (frame, [(person, row) for at, person, row in rows if at == frame])
        for frame in range(rows[-1][0] + 1)
    ]


def _dump(path: Path, content) -> Path:
    path.write_text(json.dumps(content), encoding="utf-8")
    return path


def _box(points: np.ndarray) -> list[float]:
    (x, y), (right, bottom) = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    return [x, y, right - x, bottom - y]


def _person(image: str | int, points: np.ndarray, score: float, **more: object) -> dict[str, object]:
    """An entry of COCO's results."""
    return {"image_id": image, "category_id": 1, "keypoints": points.ravel().tolist(), "score": score, **more}


def alphapose(folder: Path, scene: Scene) -> Path:
    listed = [
        _person(f"{frame}.jpg", row, 2.7, box=_box(row), idx=int(person))
        for frame, person, row in _rows(scene)
    ]
    return _dump(folder / "alphapose-results.json", listed)


def drawn_tracks(path: Path, tracks: Mapping[int, Iterable[int]]) -> Path:
    """AlphaPose's list of people with joints at random in these frames, COCO-17."""
    rng = np.random.default_rng(1)
    listed = [
        {"image_id": f"{frame}.jpg", "category_id": 1, "keypoints": rng.uniform(1, 48, 51).tolist(), "score": 2.0,
         "box": [0, 0, 9, 9], "idx": person}
        for person, frames in tracks.items() for frame in frames
    ]  # fmt: skip
    return _dump(path, sorted(listed, key=lambda one: int(one["image_id"][:-4])))


def _alphapose_dict(folder: Path, scene: Scene, people: str, joints: str) -> Path:
    images: dict[str, dict] = {}
    for frame, _, row in _rows(scene):
        image = images.setdefault(f"{frame}.jpg", {"version": "AlphaPose v0.3", people: []})
        image[people].append({joints: row.ravel().tolist()})
    return _dump(folder / "alphapose-results.json", images)


def alphapose_cmu(folder: Path, scene: Scene) -> Path:
    return _alphapose_dict(folder, scene, "bodies", "joints")


def alphapose_open(folder: Path, scene: Scene) -> Path:
    return _alphapose_dict(folder, scene, "people", "pose_keypoints_2d")


def openpose(folder: Path, scene: Scene) -> Path:
    folder = folder / "openpose"
    folder.mkdir()
    for frame, shown in _frames(scene):
        people = [
            {"person_id": [-1], "pose_keypoints_2d": row.ravel().tolist(), "face_keypoints_2d": []}
            for _, row in shown
        ]
        _dump(folder / f"walk.v2_{frame:012d}_keypoints.json", {"version": 1.3, "people": people})
    return folder


def coco_results(folder: Path, scene: Scene) -> Path:
    listed = [_person(frame, row, 0.9) for frame, _, row in _rows(scene)]
    return _dump(folder / "keypoints_results.json", listed)


def coco_tracks(folder: Path, scene: Scene) -> Path:
    listed = [
        _person(frame, row, 0.9, bbox=_box(row), track_id=int(person)) for frame, person, row in _rows(scene)
    ]
    return _dump(folder / "keypoints_results.json", listed)


def coco_annotations(folder: Path, scene: Scene) -> Path:
    """Image ids run against the frames, as nothing forbids."""
    rows = _rows(scene)
    frames = sorted({frame for frame, _, _ in rows})
    ids = {frame: 1000 - frame for frame in frames}
    content = {
        "info": {"description": 'a, "b" [c] {d}'},
        "images": [{"id": ids[frame], "file_name": f"take2/clip_{frame:05d}.PNG"} for frame in frames],
        "annotations": [
            {
                "id": i,
                "image_id": ids[frame],
                "category_id": 1,
                "keypoints": row.ravel().tolist(),
                "bbox": _box(row),
            }
            for i, (frame, _, row) in enumerate(rows)
        ],
        "categories": [
            {
                "id": 1,
                "name": "person",
                "supercategory": "person",
                "keypoints": COCO_NAMES,
                "skeleton": [[16, 14], [14, 12], [17, 15], [15, 13], [12, 13]],
            }
        ],
    }
    return _dump(folder / "person_keypoints.json", content)


def _instances(scene: Scene, first: int) -> list[dict]:
    return [
        {
            "frame_id": frame + first,
            "instances": [
                {
                    "keypoints": row[:, :2].tolist(), "keypoint_scores": row[:, 2].tolist(),
                    "bbox": [_box(row)], "bbox_score": 0.8,
                }
                for _, row in people
            ],
        }
        for frame, people in _frames(scene)
    ]  # fmt: skip


def mmpose_inferencer(folder: Path, scene: Scene) -> Path:
    return _dump(folder / "walk.json", _instances(scene, first=0))


COCO_NAMES = [
    "nose", "left_eye", "right_eye", "left_ear", "right_ear", "left_shoulder", "right_shoulder", "left_elbow",
    "right_elbow", "left_wrist", "right_wrist", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle",
    "right_ankle",
]  # fmt: skip


def mmpose_demo(folder: Path, scene: Scene) -> Path:
    meta = {
        "dataset_name": "coco",
        "keypoint_id2name": {str(i): joint for i, joint in enumerate(COCO_NAMES)},
        "keypoint_colors": {"__ndarray__": [[51, 153, 255]] * 500, "dtype": "uint8"},
    }
    return _dump(
        folder / "results_walk.json", {"meta_info": meta, "instance_info": _instances(scene, first=1)}
    )


def mmpose_images(folder: Path, scene: Scene) -> Path:
    """As --out-dir of the inferencer leaves it, the images beside."""
    for name in ("predictions", "visualizations"):
        (folder / "mmpose" / name).mkdir(parents=True)
    for frame in _instances(scene, first=0):
        path = folder / "mmpose" / "predictions" / f"walk2_{frame['frame_id']:06d}.json"
        path.write_text(json.dumps(frame["instances"], indent="  "))
    return folder / "mmpose"


def _objects(listed: list) -> np.ndarray:
    """An array (frames, 2) of Python objects, as numpy made of the script's lists before it refused to."""
    array = np.empty((len(listed), 2), dtype=object)
    for row, pair in enumerate(listed):
        array[row, 0], array[row, 1] = pair
    return array


def detectron(folder: Path, scene: Scene) -> Path:
    """infer_video_d2.py of VideoPose3D."""
    boxes, keypoints = [], []
    for _, shown in _frames(scene):
        people = [row for _, row in shown]
        kps = [np.stack([x, y, 0 * x, score]) for x, y, score in (row.T for row in people)]
        keypoints.append([[], np.array(kps, np.float32) if kps else []])
        boxes.append([[], np.array([[*_box(row), 0.9] for row in people], np.float32) if people else []])
    path = folder / "walk.mp4.npz"
    np.savez_compressed(
        path,
        boxes=_objects(boxes),
        segments=np.array([None] * len(boxes), dtype=object),
        keypoints=_objects(keypoints),
        metadata=np.array({"w": 1920, "h": 1080}, dtype=object),
    )
    return path


def videopose2d(folder: Path, scene: Scene) -> Path:
    """prepare_data_2d_custom.py of VideoPose3D; each person is of a video of their own."""
    path = folder / "data_2d_custom_mine.npz"
    sizes = {name: {"w": 1920, "h": 1080} for name in scene}
    metadata = {"layout_name": "coco", "num_joints": 17, "video_metadata": sizes}
    positions = {name: {"custom": [points[..., :2].astype("float32")]} for name, (_, points) in scene.items()}
    np.savez_compressed(path, positions_2d=positions, metadata=metadata)  # type: ignore[arg-type]  # objects
    return path


def _reconstruction(scene: Scene) -> np.ndarray:
    length = max(frames[-1] for frames, _ in scene.values()) + 1
    values = np.zeros((len(scene), length, 17, 3), np.float32)
    for person, (frames, points) in enumerate(scene.values()):
        values[person, frames] = points
    return values


def vis2d(folder: Path, scene: Scene) -> Path:
    path = folder / "keypoints.npz"
    np.savez_compressed(path, reconstruction=_reconstruction(scene)[..., :2])
    return path


def vis2d_scores(folder: Path, scene: Scene) -> Path:
    (folder / "walk" / "input_2D").mkdir(parents=True)
    np.savez_compressed(folder / "walk" / "input_2D" / "keypoints.npz", reconstruction=_reconstruction(scene))
    return folder / "walk"


def detected(
    frames: np.ndarray, points: np.ndarray, people: np.ndarray, cuts=(), source: str = ""
) -> Detections:
    """What a run of ours saved: rows of points (N, 17, 3), x, y and score, each with its frame and its person."""
    points = points.astype(np.float32)
    count = int(frames.max()) + 1
    return Detections(
        frame_index=frames,
        time_s=frames / 30,
        person=people,
        joints=points[..., :2],
        confidence=points[..., 2],
        box=np.concatenate([points[..., :2].min(axis=1), points[..., :2].max(axis=1)], axis=1),
        cuts=np.array(cuts, np.int64),
        frames=count,
        frames_seen=count,
        layout=COCO17.name,
        method="movenet@0",
        source=source,
        damaged=np.zeros(0, np.int64),
        repeated=np.zeros(0, np.int64),
        change=np.full(count, np.nan, np.float32),
    )


def scored(points: np.ndarray, score: float = 0.9) -> np.ndarray:
    """(..., 3) of points (..., 2), all with one score."""
    return np.concatenate([points, np.full_like(points[..., :1], score)], axis=-1)


def keypoints(folder: Path, scene: Scene) -> Path:
    """Of a run of ours; the file is ours, so our own writer is what makes it."""
    frames, people, points = zip(*_rows(scene), strict=True)
    detected(np.array(frames), np.stack(points), np.array([*map(int, people)])).save(folder / KEYPOINTS)
    return folder / KEYPOINTS


def ultralytics(folder: Path, scene: Scene) -> Path:
    """A list of what Results.to_json gives of each frame."""
    frames = [
        [
            {
                "name": "person", "class": 0, "confidence": 0.9, "track_id": int(person) + 1,
                "box": dict(zip(("x1", "y1", "x2", "y2"), (*row[:, :2].min(0), *row[:, :2].max(0)), strict=True)),
                "keypoints": {"x": row[:, 0].tolist(), "y": row[:, 1].tolist(), "visible": row[:, 2].tolist()},
            }
            for person, row in people
        ]
        for _, people in _frames(scene)
    ]  # fmt: skip
    return _dump(folder / "results.json", frames)


IMAGE_SIZE = (1000, 500)  # of the folder of texts, whose coordinates are shares of it


def ultralytics_texts(folder: Path, scene: Scene) -> Path:
    """The folder that save_txt and save_conf fill, frames from 1."""
    folder = folder / "labels"
    folder.mkdir()
    for frame, people in _frames(scene):
        shares = [row / [*IMAGE_SIZE, 1] for _, row in people]
        lines = [" ".join(f"{v:.7f}" for v in (0, *_box(row), *row.ravel())) for row in shares]
        if people:
            (folder / f"walk_{frame + 1}.txt").write_text("\n".join(lines) + "\n")
    return folder


def _named_points(row: np.ndarray) -> list[tuple[str, float, float, float]]:
    """Name, x, y and score of COCO's joints (17, 3)."""
    return [(name, *point) for name, point in zip(COCO_NAMES, row.tolist(), strict=True)]


def tfjs(folder: Path, scene: Scene) -> Path:
    """MoveNet's poses of each frame, as JSON.stringify writes them."""
    frames = []
    for frame, people in _frames(scene):
        poses = [
            {
                "keypoints": [
                    {"x": x, "y": y, "score": score, "name": name} for name, x, y, score in _named_points(row)
                ]
            }
            for _, row in people
        ]
        frames.append({"frameNumber": frame, "poses": poses})
    return _dump(folder / "movenet.json", {"model": "MoveNet", "frames": frames})


def posenet(folder: Path, scene: Scene) -> Path:
    """PoseNet's poses of each frame: a place and a part for each keypoint."""
    frames = [
        [
            {
                "score": 0.9,
                "keypoints": [
                    {"score": score, "part": name.title().replace("_", ""), "position": {"x": x, "y": y}}
                    for name, x, y, score in _named_points(row)
                ],
            }
            for _, row in people
        ]
        for _, people in _frames(scene)
    ]
    return _dump(folder / "posenet.json", frames)


def ml5(folder: Path, scene: Scene) -> Path:
    """The same as ml5 gives it."""
    frames = json.loads(posenet(folder, scene).read_text(encoding="utf-8"))
    return _dump(
        folder / "posenet.json", [[{"pose": pose, "skeleton": []} for pose in frame] for frame in frames]
    )


def _flat(scene: Scene) -> list[dict]:
    """Frames of people as OpenPifPaf says them."""
    return [
        {
            "frame": frame,
            "predictions": [
                {"keypoints": row.ravel().tolist(), "bbox": _box(row), "score": 0.8, "category_id": 1,
                 "id_": int(person)}
                for person, row in people
            ],
        }
        for frame, people in _frames(scene)
    ]  # fmt: skip


def openpifpaf(folder: Path, scene: Scene) -> Path:
    """JSON Lines of its video mode."""
    path = folder / "walk.mp4.openpifpaf.json"
    path.write_text("".join(json.dumps(frame) + "\n" for frame in _flat(scene)), encoding="utf-8")
    return path


def openpifpaf_images(folder: Path, scene: Scene) -> Path:
    folder = folder / "predictions"
    folder.mkdir()
    for frame in _flat(scene):
        _dump(folder / f"walk_{frame['frame']:04d}.jpg.predictions.json", frame["predictions"])
    return folder


def easymocap(folder: Path, scene: Scene) -> Path:
    """EasyMocap's annots of one camera."""
    folder = folder / "annots"
    folder.mkdir()
    for frame in _flat(scene):
        people = [
            {
                "personID": i,
                "bbox": person["bbox"],
                "keypoints": np.reshape(person["keypoints"], (-1, 3)).tolist(),
            }
            for i, person in enumerate(frame["predictions"])
        ]
        _dump(folder / f"{frame['frame']:06d}.json", {"height": 1080, "width": 1920, "annots": people})
    return folder


def sapiens(folder: Path, scene: Scene) -> Path:
    """A folder of an image each, of 308 joints: 70 of the body and the hands, others of the face."""
    folder = folder / "sapiens"
    folder.mkdir()
    rows = [*range(70), *[0] * 238]
    for frame in _instances({name: (at, points[:, rows]) for name, (at, points) in scene.items()}, first=0):
        _dump(folder / f"walk_{frame['frame_id']:04d}.json", {"instance_info": frame["instances"]})
    return folder


def openpose137(folder: Path, scene: Scene) -> Path:
    """An array of BODY_25, hands and face of the first person."""
    _, points = scene["0"]
    np.save(folder / "keypoints.npy", points[:, [*range(25), *[0] * 112]])
    return folder / "keypoints.npy"


def sleap(folder: Path, scene: Scene) -> Path:
    """SLEAP's analysis CSV."""
    names = [f"{joint}.{axis}" for joint in COCO_NAMES for axis in ("x", "y", "score")]
    lines = [",".join(["track", "frame_idx", "instance.score", *names])]
    lines += [
        ",".join(map(str, [f"track_{person}", frame, 0.9, *row.ravel()]))
        for frame, person, row in _rows(scene)
    ]
    (folder / "walk.analysis.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder / "walk.analysis.csv"


def rtmlib(folder: Path, scene: Scene) -> Path:
    """numpy.savez of keypoints (T, P, 17, 2) and scores (T, P, 17), padded with zeros."""
    values = np.moveaxis(_reconstruction(scene), 0, 1)
    np.savez(folder / "keypoints.npz", keypoints=values[..., :2], scores=values[..., 2])
    return folder / "keypoints.npz"


def array2d(folder: Path, scene: Scene) -> Path:
    """(T, 17, 3) of the first person."""
    np.save(folder / "keypoints.npy", _reconstruction(scene)[0])
    return folder / "keypoints.npy"


def deeplabcut(folder: Path, scene: Scene) -> Path:
    """The CSV of one individual."""
    frames, points = scene["0"]
    columns = [(joint, axis) for joint in COCO_NAMES for axis in ("x", "y", "likelihood")]
    lines = [
        ",".join(["scorer", *["DLC_resnet50_walkNov1shuffle1_200000"] * len(columns)]),
        ",".join(["bodyparts", *[joint for joint, _ in columns]]),
        ",".join(["coords", *[axis for _, axis in columns]]),
        *(",".join(map(str, [frame, *row.ravel()])) for frame, row in zip(frames, points, strict=True)),
    ]
    (folder / "walkDLC.csv").write_text("\n".join(lines) + "\n")
    return folder / "walkDLC.csv"


def columns(folder: Path, scene: Scene) -> Path:
    """A row a person and frame, as many save tracks of Ultralytics."""
    names = [f"{joint}_{axis}" for joint in COCO_NAMES for axis in ("x", "y", "conf")]
    lines = [",".join(["frame", "track_id", *names])]
    lines += [",".join(map(str, [frame, person, *row.ravel()])) for frame, person, row in _rows(scene)]
    (folder / "tracks.csv").write_text("\n".join(lines) + "\n")
    return folder / "tracks.csv"


WRITERS = {
    writer.__name__: writer
    for writer in (
        alphapose, alphapose_cmu, alphapose_open, openpose, coco_results, coco_tracks, coco_annotations,
        mmpose_inferencer, mmpose_demo, mmpose_images, detectron, videopose2d, vis2d, vis2d_scores, keypoints,
        ultralytics, ultralytics_texts, tfjs, posenet, ml5, openpifpaf, openpifpaf_images, easymocap, sapiens,
        openpose137, sleap, rtmlib, array2d, deeplabcut, columns,
    )
}  # fmt: skip
