"""2D keypoints in JSON of whoever wrote it: OpenPose, MMPose, AlphaPose, COCO and others (formats.md 5)."""

import json

import numpy as np
import pytest

from golden.bodies import Person
from golden.catalogue import recognised
from golden.detections import AS_COCO, WRITERS, between_shoulders
from golden.detections import openpose as write_openpose
from pcnet3d.adapters import json2d, mmpose3d, read, read_all
from pcnet3d.adapters.kit.json import beginning
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.conversions import remap
from pcnet3d.pipeline.core.layouts import BODY_25B, COCO17, OPENPOSE18
from pcnet3d.pipeline.reading.joint_order import likely_layout, misfit, other_order
from pcnet3d.pipeline.reading.load import adapters
from refusals import refused

# What OpenPose found of a man in one frame of Pose2Sim's demo (BSD-3-Clause), in BODY_25B.
_REAL = (
    (505, 432, 0.66), (516, 411, 0.61), (489, 405, 0.67), (521, 405, 0.13), (453, 400, 0.68),
    (521, 495, 0.71), (384, 479, 0.67), (542, 610, 0.66), (300, 595, 0.69), (568, 721, 0.67),
    (269, 716, 0.71), (479, 736, 0.68), (389, 726, 0.65), (458, 921, 0.64), (369, 899, 0.66),
    (421, 1078, 0.67), (332, 1010, 0.66), (463, 463, 0.65), (516, 342, 0.69), (432, 1147, 0.68),
    (447, 1141, 0.70), (400, 1094, 0.65), (326, 1062, 0.63), (311, 1047, 0.63), (332, 1026, 0.56),
)  # fmt: skip


def test_frames_are_sorted_by_number_and_may_be_empty(write, moving):
    frames, points = moving(25, [0, 2, 9, 10, 11])
    folder = write("openpose", {"0": (frames, points)})
    assert len(list(folder.iterdir())) == 12
    poses = read(folder)
    np.testing.assert_array_equal(poses.frame_index, frames)
    np.testing.assert_allclose(poses.joints, points[..., :2], atol=1e-4)


@pytest.mark.parametrize(
    "name", ["cam01.{:04d}.json", "{}.json", "cam 2 b{:03d}_keypoints.json", "walk_{}0_cam2.json"]
)
def test_other_names(write, moving, name):
    """Pose2Sim's and others'; the last number that is not the same in all is the frame."""
    folder = write("openpose", {"0": moving(25)})
    for i, file in enumerate(sorted(folder.iterdir())):
        file.rename(folder / name.format(i))
    (folder / "notes.json").write_text("{}")
    poses = read(folder)
    assert poses.history[0].options["adapter"] == "json2d"
    np.testing.assert_array_equal(poses.frame_index, np.arange(12) * (10 if "{}0" in name else 1))


@pytest.mark.parametrize("name", ["caf\udce9", "\U0001f600", "C:\\data\\a", '"\\"'])
def test_images_of_any_name_are_recognised(tmp_path, name):
    """Names that are no text come as halves of characters."""
    path = tmp_path / "results.json"
    path.write_text(json.dumps([{"image_id": name, "keypoints": [1.0]}] * 3000))
    assert len(beginning(path)) > 100


@pytest.mark.parametrize("field", ["frame", "time"])
def test_numbers_of_hundreds_of_digits_are_no_clock(tmp_path, walk, field):
    path = tmp_path / "a.json"
    entries = [{field: 10**400 + i, "keypoints": person.ravel().tolist()} for i, person in enumerate(walk)]
    path.write_text(json.dumps(entries))
    if field == "frame":
        with refused("wrong-content", "'frame'"):
            read(path)
    else:
        assert "clock-not-used" in [each.code for each in read(path, layout="H36M17").notices]


def test_body_25b_is_known_by_its_limbs(tmp_path):
    frames, points = np.arange(3), np.array(_REAL)[None] + np.arange(3)[:, None, None] * [2, 1, 0]
    poses = read(write_openpose(tmp_path, {"0": (frames, points)}))
    assert poses.layout == BODY_25B
    np.testing.assert_allclose(poses.joint("r_wrist"), points[:, COCO17.index("r_wrist"), :2])
    shoulders = poses.joints[:, BODY_25B.indices(["l_shoulder", "r_shoulder"])].mean(axis=1)
    np.testing.assert_allclose(remap(poses).joint("thorax"), shoulders)  # not the upper neck


def test_other_files_beside_are_ignored(write, moving):
    folder = write("openpose", {"0": moving(25)})
    for other in ("._walk_000000000003_keypoints.json", "walk.avi", "notes.json"):
        (folder / other).write_bytes(b"\x00\x05\x16\x07")
    assert len(read(folder)) == 12


def test_normalised_coordinates_are_refused(write, moving):
    """--keypoint_scale 3 and 4 write coordinates in [0, 1] and [-1, 1]."""
    frames, points = moving(25)
    with pytest.raises(InputError, match=r"expected pixels.*keypoint_scale 0"):
        read(write("openpose", {"0": (frames, points * [1e-3, 1e-3, 1])}))


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("run_000000000000", '{"people": []}', r"one video.*run_\* and walk.v2_\*"),
        ("front", '{"people": []}', r"front_keypoints\.json: expected an image that is numbered"),
        ("walk.v2_000000000007", '{"people": [{"pose_', r"0007_keypoints.json, but its JSON is incomplete"),
    ],
)
def test_a_file_that_does_not_belong_there_is_named(write, moving, name, content, words):
    folder = write("openpose", {"0": moving(25)})
    (folder / f"{name}_keypoints.json").write_text(content)
    with pytest.raises(InputError, match=words):
        read(folder)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("front", r"front_keypoints\.json: expected an image that is numbered"),
        ("walk_000000000000", "no person was found"),
    ],
)
def test_files_without_a_number_or_a_person_are_refused(tmp_path, name, words):
    (tmp_path / f"{name}_keypoints.json").write_text('{"version": 1.3, "people": []}')
    with pytest.raises(InputError, match=words):
        read(tmp_path, "json2d")


@pytest.fixture(params=["mmpose_inferencer", "mmpose_demo"])
def path(request, write, moving):
    return write(request.param, {"0": moving(17, [0, 1, 5, 6])})


def _edited(path, edit):
    content = json.loads(path.read_text())
    edit(content["instance_info"] if isinstance(content, dict) else content)
    path.write_text(json.dumps(content))
    return path


def test_null_is_missing(path):
    def null(frames):
        frames[0]["instances"][0]["keypoints"][4] = [None, None]

    assert np.argwhere(np.isnan(read(_edited(path, null)).joints).any(axis=-1)).tolist() == [[0, 4]]


def test_3d_output_is_refused(path):
    def deepen(frames):
        for frame in frames:
            for person in frame["instances"]:
                person["keypoints"] = [[*xy, 0.5] for xy in person["keypoints"]]

    path = _edited(path, deepen)
    assert not json2d.sniff(path)
    with refused("format-unknown"):
        json2d.read(path)


def test_demo_frame_zero(write, moving):
    path = write("mmpose_demo", {"0": moving(17)})
    with refused("times-broken"):
        read(_edited(path, lambda frames: frames[0].update(frame_id=0)))


def test_recognised_though_the_first_frames_are_empty(write, moving):
    path = write("mmpose_inferencer", {"0": moving(17, range(500, 512))})
    assert json2d.sniff(path)
    assert read(path).frame_index[0] == 500


def test_images_are_numbered_by_their_names(write, moving):
    folder = write("mmpose_images", {"0": moving(17, [3, 4, 8])})
    for path in (folder, folder / "predictions"):
        np.testing.assert_array_equal(read(path).frame_index, [3, 4, 8])


def test_3d_of_images(tmp_path, facing_camera):
    """Pose3DInferencer over images; the first of them shows nobody."""
    mirrored = facing_camera[:, [0, 2, 1]] * [-1, 1, -1]
    person = {"keypoints": mirrored.tolist(), "keypoint_scores": [1.0] * 17, "bbox": [[1.0, 1, 9, 9]]}
    for number in range(25):
        (tmp_path / f"{number}.json").write_text(json.dumps([person] if number else []))
    assert [name for name, each in adapters().items() if each.sniff(tmp_path)] == ["mmpose3d"]
    poses = read(tmp_path, fps=25)
    np.testing.assert_array_equal(poses.frame_index, np.arange(1, 25))
    np.testing.assert_allclose(poses.joints, np.repeat(facing_camera[None], 24, axis=0), atol=1e-6)
    person["keypoints"] = mirrored[:, :2].tolist()
    (tmp_path / "7.json").write_text(json.dumps([person]))
    with pytest.raises(InputError, match=r"7\.json.*json2d reads"):
        mmpose3d.read(tmp_path)


@pytest.fixture
def results(tmp_path):
    """Write a list of (image_id, idx, x of every joint, score); idx None is left out."""

    def make(*rows, joints=17):
        listed = []
        for image, idx, x, score in rows:
            flat = np.column_stack(
                [np.full(joints, x), np.arange(joints) * 10.0, np.full(joints, score)]
            ).ravel()
            entry = {"image_id": image, "category_id": 1, "keypoints": flat.tolist(), "score": 3.1}
            listed.append(entry if idx is None else {**entry, "box": [0, 0, 9, 9], "idx": idx})
        path = tmp_path / "alphapose-results.json"
        path.write_text(json.dumps(listed))
        return path

    return make


def test_images_are_sorted_by_number(results):
    path = results(
        ("10.jpg", 1, 110, 0.5), ("9.jpg", 1, 109, 0.6), ("100.jpg", 1, 200, 0.7), ("2.jpg", 1, 102, 0.4)
    )
    poses = read(path)
    np.testing.assert_array_equal(poses.frame_index, [2, 9, 10, 100])
    np.testing.assert_array_equal(poses.joints[:, 0, 0], [102, 109, 110, 200])
    np.testing.assert_allclose(poses.confidence[:, 0], [0.4, 0.6, 0.5, 0.7], atol=1e-6)


@pytest.mark.parametrize("image", ["7.jpg", "frame_0007.png", "cam2_0007.jpeg", "take.v2_000007.jpg", "7", 7])
def test_image_numbers(results, image):
    assert read(results((image, 3, 200, 0.5))).frame_index.tolist() == [7]


@pytest.mark.parametrize("image", ["portrait.jpg", "", -1, True, None, 7.5, [7], 10**30, "9" * 5000 + ".jpg"])
def test_images_without_number(results, image):
    with pytest.raises(InputError, match="numbered by its video frame"):
        json2d.read(results((image, 1, 200, 0.5), ("3.jpg", 1, 200, 0.5)))


@pytest.mark.parametrize("idx", [4, 4.0])
def test_track_numbers(results, idx):
    first, second = read_all(
        results(("0.jpg", 1, 100, 0.5), ("0.jpg", idx, 300, 0.5), ("1.jpg", idx, 301, 0.6))
    )
    assert (first.person, second.person) == ("1", "4")
    np.testing.assert_array_equal(second.joints[:, 0, 0], [300, 301])


def test_without_tracking_two_people_are_refused(results):
    """AlphaPose without --pose_track gives everybody idx 0."""
    path = results(
        ("0.jpg", 0, 100, 0.5), ("0.jpg", 0, 400, 0.5), ("1.jpg", 0, 401, 0.6), ("1.jpg", 0, 101, 0.6)
    )
    with pytest.raises(InputError, match=r"more than once in frame 0.*track=true"):
        read_all(path)
    first, second = read_all(path, track="true")
    np.testing.assert_array_equal(first.joints[:, 0, 0], [100, 101])
    np.testing.assert_array_equal(second.joints[:, 0, 0], [400, 401])
    assert first.history[-1].options == {"method": "nearest"}


def test_scores_above_one_are_clipped_and_counted(results):
    poses = read(results(("0.jpg", 1, 100, 1.25), ("1.jpg", 1, 101, 0.5)))
    np.testing.assert_allclose(poses.confidence[:, 0], [1, 0.5])
    assert poses.history[-1].options == {"clipped": 17, "highest": 1.25}


@pytest.mark.parametrize("joints", [1, 16, 19, 200])
def test_other_numbers_of_joints(results, joints):
    with pytest.raises(InputError, match=rf"expected people of 17, .* joints.* 308, got {joints}\."):
        read(results(("0.jpg", 1, 100, 0.5), joints=joints))


@pytest.mark.parametrize(("joints", "layout"), [(136, "HALPE26"), (133, "COCO23"), (94, "HALPE26")])
def test_of_whole_body_models_the_body_is_read(results, joints, layout):
    poses = read(results(("0.jpg", 1, 100, 0.5), joints=joints))
    assert poses.layout.name == layout
    np.testing.assert_allclose(poses.joints[0, :, 1], 10.0 * np.arange(len(poses.layout)))


def test_neck_that_is_a_head_is_refused(write, moving):
    """With Halpe models --format cmu writes the top of the head where the neck belongs."""
    frames, points = moving(18)
    shoulders = points[:, OPENPOSE18.indices(["l_shoulder", "r_shoulder"]), :2].mean(axis=1)
    points[:, OPENPOSE18.index("neck"), :2] = shoulders - [0, 60]
    with pytest.raises(InputError, match="without --format"):
        read(write("alphapose_cmu", {"0": (frames, points)}))


@pytest.mark.data("lifter", "native")
def test_real_file(data):
    """301 frames of Halpe-26, which the data folder also holds as an array; 89 scores exceed 1."""
    poses = read(data / "native" / "motionbert" / "boxing_alphapose-results.json", fps=30)
    with np.load(data / "lifter" / "boxing.npz") as known:
        points = known["alphapose_kp2d"]
    np.testing.assert_array_equal(poses.joints, points[..., :2])
    np.testing.assert_array_equal(poses.confidence, np.clip(points[..., 2], 0, 1))
    np.testing.assert_array_equal(poses.frame_index, np.arange(301))
    assert poses.layout.name == "HALPE26"
    assert any(step.options.get("clipped") == (points[..., 2] > 1).sum() for step in poses.history)


def test_visibility_flags_are_no_confidence(write, moving):
    frames, points = moving(17)
    points[..., 2] = 2
    points[2, 5, 2] = 1  # hidden, but labelled
    points[3, 6, 2] = 0  # not labelled, whatever stands there
    poses = read(write("coco_annotations", {"0": (frames, points)}))
    assert np.isnan(poses.confidence).all()
    missing = np.isnan(poses.joints).any(axis=-1)
    assert missing[3, 6]
    assert missing.sum() == 1
    np.testing.assert_allclose(poses.joints[2, 5], points[2, 5, :2])
    assert poses.history[-1].options == {"unknown": "visibility flags"}


@pytest.fixture
def annotations(write, moving):
    """annotations(change, frames): the file of one person after change(content)."""

    def make(change, frames=range(12)):
        path = write("coco_annotations", {"0": moving(17, frames)})
        content = json.loads(path.read_text())
        change(content)
        path.write_text(json.dumps(content))
        return path

    return make


def test_annotations_without_keypoints_are_other_things(annotations):
    other = {"id": 99, "image_id": 1000, "category_id": 2, "bbox": [0, 0, 5, 5]}
    assert len(read(annotations(lambda content: content["annotations"].append(other)))) == 12


def test_images_without_people_may_have_one_name(annotations):
    def listed(content):
        content["images"] += [{"id": 10**6 + i, "file_name": "empty.jpg"} for i in range(2)]

    assert len(read(annotations(listed))) == 12


def test_annotation_of_an_unlisted_image(annotations):
    path = annotations(lambda content: content["annotations"][5].update(image_id=[7]))
    with pytest.raises(InputError, match=r"annotation 5: expected an image that the file lists, got '\[7\]'"):
        read(path)


@pytest.mark.parametrize("held", [{}, {"annotations": None}, {"annotations": {"1": {}}}])
def test_a_file_without_a_list_of_annotations_is_said_to_be_none(annotations, held):
    def without(content):
        del content["annotations"]
        content.update(held)

    with refused("wrong-content", "annotation"):
        read(annotations(without))


def test_long_list_of_images_before_the_annotations(annotations):
    more = [{"id": -i, "file_name": f"{i:030d}.jpg"} for i in range(1, 3000)]
    path = annotations(lambda content: content["images"].extend(more))
    assert path.stat().st_size > 100_000
    assert json2d.sniff(path)
    assert len(read(path)) == 12


def test_negative_image_id(write, moving):
    path = write("coco_results", {"0": moving(17)})
    path.write_text(path.read_text().replace('"image_id": 3,', '"image_id": -3,'))
    with pytest.raises(InputError, match=r"expected an image that is numbered.*-3"):
        read(path)


def test_detections_that_a_tracker_did_not_name_are_left_out_and_counted(write, moving):
    """The second person comes first in the file's first frame, so that the order of appearance is not that of names."""
    path = write("coco_tracks", {"5": moving(17, number=1), "4": moving(17)})
    content = json.loads(path.read_text())
    content[6]["track_id"] = None
    del content[9]["track_id"]
    path.write_text(json.dumps(content))
    people = {poses.person: poses for poses in read_all(path)}
    assert sorted(people) == ["4", "5"]
    assert sum(map(len, people.values())) == 22
    np.testing.assert_allclose(people["4"].joints[:, 0, 0], 100.25 + 2 * people["4"].frame_index)
    (step,) = [step for step in people["4"].history if step.name == "track numbers"]
    assert step.options["left_out"] == 2
    (said,) = people["4"].notices
    assert (said.code, dict(said.values)) == ("no-track-number", {"unnamed": 2, "detections": 24})
    assert [len(poses) for poses in read_all(path, track=True)] == [12, 12]


@pytest.mark.parametrize(
    ("names", "frames"),
    [
        (["a/0001.jpg", "a/0002.jpg"], [1, 2]),
        (["a/0001.jpg", "b/0002.jpg"], None),
        (["0001.jpg", "b/0002.jpg"], None),
        (["walk_0001.jpg", "run_0001.jpg"], None),
        (["0001.jpg", "0001.jpg"], None),
        (["walk_mp4-0001_jpg.rf.0f31b2c4.jpg", "walk_mp4-0002_jpg.rf.b7e0a991.jpg"], [1, 2]),
    ],
)
def test_images_are_those_of_one_video(annotations, names, frames):
    def renamed(content):
        for image, name in zip(content["images"], names, strict=True):
            image["file_name"] = name

    path = annotations(renamed, [1, 2])
    if frames is not None:
        assert read(path).frame_index.tolist() == frames
    else:
        with refused("files-apart"):
            read(path)


@pytest.mark.parametrize("beside", [{}, {"box": [0, 0, 9, 9]}])
def test_track_numbers_beside_images_names(write, moving, beside):
    path = write("coco_tracks", {"4": moving(17, range(6)), "5": moving(17, range(6, 12))})
    content = [
        {**entry, **beside, "image_id": f"{entry['image_id']}.jpg"} for entry in json.loads(path.read_text())
    ]
    path.write_text(json.dumps(content))
    people = read_all(path)
    assert people[0].history[0].options["adapter"] == "json2d"
    assert [poses.person for poses in people] == ["4", "5"]
    np.testing.assert_array_equal(people[1].frame_index, np.arange(6, 12))


@pytest.fixture(scope="module")
def walk() -> np.ndarray:
    """(40, 17, 3) x, y and score of a person in Human3.6M's order, in pixels."""
    joints = Person().turning(40)[..., :2] * 200 + [400, 300]
    scores = np.broadcast_to(np.linspace(0.3, 0.9, 17), joints.shape[:2])
    return np.concatenate([joints, scores[..., None]], axis=-1)


@pytest.mark.parametrize("form", ["coco_results", "openpose"])
def test_another_order_is_refused_with_the_one_that_fits(tmp_path, walk, form):
    (tmp_path / "own").mkdir()
    path = WRITERS[form](tmp_path, {"0": (np.arange(40), walk)})
    with pytest.raises(InputError, match=r"order of COCO17.*H36M17.*keypoints\.layout=H36M17") as caught:
        read(path)
    assert caught.value.code == "wrong-content"
    assert read(path, layout="H36M17").layout == H36M17
    assert read(path, layout="COCO17").layout == COCO17
    with refused("bad-value"):
        read(path, layout="HALPE26")
    (poses,) = read_all(WRITERS[form](tmp_path / "own", {"0": (np.arange(40), walk[:, AS_COCO])}))
    assert poses.layout == COCO17


def test_a_bare_array_is_read_in_the_order_of_its_bones_and_says_so(tmp_path, walk):
    np.save(tmp_path / "a.npy", walk.astype(np.float32))
    poses = read(tmp_path / "a.npy")
    assert poses.layout == H36M17
    assert [each.code for each in poses.notices] == ["order-by-bones"]
    np.save(tmp_path / "a.npy", walk[:, AS_COCO].astype(np.float32))
    poses = read(tmp_path / "a.npy")
    assert poses.layout == COCO17
    assert not poses.notices


@pytest.mark.parametrize("shape", [(1, 40, 17, 2), (40, 1, 17, 2), (40, 17, 2)])
def test_bare_arrays_with_axes_of_length_1(tmp_path, walk, shape):
    np.save(tmp_path / "a.npy", walk[:, AS_COCO, :2].reshape(shape).astype(np.float32))
    poses = read(tmp_path / "a.npy")
    assert len(poses) == 40
    assert not poses.frames_known


def test_shares_of_an_image_need_its_size(tmp_path, walk):
    shares = walk[:, AS_COCO, :2] / [1000, 800]
    np.save(tmp_path / "a.npy", shares.astype(np.float32))
    with refused("needs-input"):
        read(tmp_path / "a.npy")
    poses = read(tmp_path / "a.npy", image_size=(1000, 800))
    np.testing.assert_allclose(poses.joints, walk[:, AS_COCO, :2], atol=1e-3)
    np.save(tmp_path / "a.npy", walk[:, AS_COCO, :2] - 5000)  # pixels, beside the image
    assert read(tmp_path / "a.npy").joints.max() < -1000


def test_scores_of_0_are_said(tmp_path, walk):
    walk = walk.copy()
    walk[..., 2] = 0
    poses = read(WRITERS["coco_results"](tmp_path, {"0": (np.arange(40), walk[:, AS_COCO])}))
    assert len(poses) == 40
    assert np.isnan(poses.confidence).all()
    assert [each.code for each in poses.notices] == ["scores-all-zero"]


def test_openpose_1_0_calls_the_field_otherwise(tmp_path, walk):
    folder = WRITERS["openpose"](tmp_path, {"0": (np.arange(40), walk[:, AS_COCO])})
    for file in folder.iterdir():
        file.write_text(file.read_text().replace("pose_keypoints_2d", "pose_keypoints"))
    assert len(read(folder)) == 40


def test_motionberts_annotations_have_frames_of_their_own(tmp_path, walk):
    listed = [{"frame_id": i, "keypoints": row.ravel().tolist()} for i, row in enumerate(walk[:, AS_COCO])]
    del listed[10:15]
    (tmp_path / "a.json").write_text(json.dumps({"annotations": listed}))
    poses = read(tmp_path / "a.json")
    assert poses.history[0].options["adapter"] == "json2d"
    assert poses.frame_index.tolist() == [*range(10), *range(15, 40)]


def test_the_folder_of_ultralytics_texts(tmp_path, walk):
    folder = WRITERS["ultralytics_texts"](tmp_path, {"0": (np.arange(40), walk[:, AS_COCO])})
    with refused("needs-input"):
        read(folder)
    (folder / "walk_3.txt").write_text("0 0.5 0.5 what\n")
    with pytest.raises(InputError, match=r"walk_3\.txt, line 1"):
        read(folder, image_size=(1000, 500))


def test_misfit_is_of_the_order_alone(walk):
    """Scale, place and single missing joints are no matter."""
    points = walk[..., :2]
    assert misfit(points, H36M17) < 0.15
    assert misfit(3 * points - 1000, H36M17) == pytest.approx(misfit(points, H36M17))
    assert misfit(points, COCO17) > 0.2
    assert other_order(points, COCO17, (H36M17,)) == H36M17
    assert other_order(points, H36M17, (COCO17,)) is None
    assert other_order(points[:5], COCO17, (H36M17,), fewest=10) is None
    assert likely_layout(points[:, AS_COCO], (COCO17, H36M17)) == COCO17
    assert likely_layout(np.full((3, 17, 2), np.nan), (COCO17, H36M17)) == COCO17


FORMS = (
    "alphapose", "alphapose_open", "coco_results", "coco_annotations", "mmpose_inferencer", "mmpose_demo"
)  # fmt: skip
BAD = {
    "empty": (b"", "empty"),
    "blank": (b" \n ", "empty"),
    "not UTF-8": (b'[{"image_id": "\xff.jpg"}]', "UTF-8"),
    "UTF-16": ("[]".encode("utf-16"), "UTF-8"),
    "text": (b"hello", "line 1, column 1"),
    "deeply nested": (b"[" * 50_000 + b"]" * 50_000, "no detector writes"),
    "long integer": (b"[" + b"9" * 9000 + b"]", "no detector writes"),
    "number": (b"3", "expected a list"),
    "text value": (b'"a"', "expected a list"),
    "list of numbers": (b"[1, 2]", "entry 0: expected an object with"),
    "list of nothing": (b"[null]", "entry 0: expected an object with"),
    "empty object": (b"{}", "expected"),
    "other object": (b'{"images": 3, "instance_info": 3, "1.jpg": {"people": 3}}', "expected"),
    "deep with commas": (b"[1," * 30_000, "results"),
    "other objects": (b'[{"image_id": 3}, {"frame_id": 1, "instances": {"a": 1}}]', "expected"),
    "instances of another kind": (b'[{"frame_id": 1, "instances": [[1, 2]]}]', "expected"),
    "3D instances": (b'[{"frame_id": 1, "instances": [{"keypoints": [[1, 2, 3], [4, 5, 6]]}]}]', "expected"),
    "no objects": (b'{"images": [1], "annotations": [2], "instance_info": [3]}', "expected"),
}


def test_noise_is_nobodys(tmp_path):
    folder = tmp_path / "frames"
    folder.mkdir()
    for noise, _ in BAD.values():
        for path in (tmp_path / "noise.json", folder / "walk_000000000000_keypoints.json"):
            path.write_bytes(noise)
        for place in (tmp_path / "noise.json", folder):
            assert recognised(place) == []


def test_refused(tmp_path):
    for content, message in BAD.values():
        path = tmp_path / "results.json"
        path.write_bytes(content)
        with pytest.raises(InputError, match=message) as caught:
            json2d.read(path)
        assert str(path) in str(caught.value)
        assert len(str(caught.value)) < 400 + len(str(path))


@pytest.mark.parametrize("form", FORMS)
def test_truncated_file_is_recognised_and_refused(write, moving, form):
    person = between_shoulders(moving(18)) if form == "alphapose_open" else moving(17)
    path = write(form, {"0": person})
    whole = path.read_bytes()
    for share in (0.7, 0.9):  # the demos' metadata, which tell nothing, take half of so short a file
        path.write_bytes(whole[: int(share * len(whole))])
        assert json2d.sniff(path)
        with pytest.raises(InputError, match="is incomplete or damaged at line 1"):
            json2d.read(path)
    path.write_bytes(whole[:-1])
    with pytest.raises(InputError, match="is incomplete"):
        json2d.read(path)
