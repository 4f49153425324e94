"""2D joints by their number and their order: cut to what is known, and refused in an order that is not the format's."""

import json

import numpy as np
import pytest

from golden.bodies import Person
from golden.detections import AS_COCO, WRITERS
from pcnet3d.adapters import read, read_all
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.reading.joint_order import likely_layout, misfit, other_order
from refusals import refused


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
