"""2D of vis.py and of VideoPose3D: arrays, and Python objects in .npz that are read without unpickling."""

import numpy as np
import pytest

from golden.pickles import Trap
from pcnet3d.adapters import detectron, read, read_all, vis2d
from pcnet3d.pipeline import InputError
from refusals import refused


def test_row_of_zeros_is_a_frame_without_a_person(write, moving):
    frames, points = moving(17, [0, 1, 2, 5, 6])
    poses = read(write("vis2d", {"0": (frames, points)}))
    np.testing.assert_array_equal(poses.frame_index, np.arange(7))
    np.testing.assert_array_equal(np.isnan(poses.joints).all(axis=(1, 2)), [0, 0, 0, 1, 1, 0, 0])


@pytest.mark.parametrize(
    ("key", "shape", "words"),
    [
        *(
            ("reconstruction", shape, "expected an array of shape")
            for shape in ((12, 17, 3), (1, 12, 17, 4), (1, 12, 16, 2), (12, 17, 2), (17, 2))
        ),
        ("positions_2d", (1, 12, 17, 2), r"'reconstruction'.*positions_2d"),
    ],
)
def test_other_shapes_and_keys_are_not_its_own(tmp_path, key, shape, words):
    path = tmp_path / "keypoints.npz"
    np.savez(path, **{key: np.ones(shape, np.float32)})
    assert not vis2d.sniff(path)
    with pytest.raises(InputError, match=words):
        vis2d.read(path)


@pytest.mark.data("lifter", "native")
def test_real_folder(data):
    """The folder of an MHFormer run, its file, and the same keypoints as an array."""
    folder = data / "native" / "mhformer" / "skating"
    with np.load(data / "lifter" / "mhformer_skating.npz") as known:
        points = known["run_a_kp2d"]
    for path in (folder, folder / "input_2D" / "keypoints.npz"):
        (poses,) = read_all(path, gives="keypoints", fps=25)
        np.testing.assert_array_equal(poses.joints, points)
        np.testing.assert_array_equal(poses.frame_index, np.arange(291))
    assert not vis2d.sniff(folder / "output_3D" / "output_keypoints_3d.npz")


SYMMETRY = [[1, 3, 5, 7, 9, 11, 13, 15], [2, 4, 6, 8, 10, 12, 14, 16]]


@pytest.fixture
def save(tmp_path, moving):
    """save(positions, layout): prepare_data_2d_custom.py; of None the videos "a" and "b"."""

    def write(positions=None, layout="coco"):
        if positions is None:
            positions = {
                name: {"custom": [moving(17, number=number)[1][..., :2].astype("float32")]}
                for number, name in enumerate("ab")
            }
        metadata = {
            "layout_name": layout, "num_joints": 17, "keypoints_symmetry": SYMMETRY,
            "video_metadata": {name: {"w": 1920, "h": 1080} for name in positions},
        }  # fmt: skip
        path = tmp_path / "data_2d_custom_mine.npz"
        np.savez_compressed(path, positions_2d=positions, metadata=metadata)
        return path

    return write


def test_several_videos_have_to_be_named(save):
    for options, words in (({}, "holds the videos a, b"), ({"video": "c"}, "no video 'c'; it holds a, b")):
        with pytest.raises(InputError, match=words):
            read(save(), **options)
    with pytest.raises(InputError, match="layout 'coco', got 'h36m'"):
        read(save(layout="h36m"), video="a")


def test_a_file_that_would_run_something_is_refused(save, write, moving, tmp_path):
    mark = tmp_path / "was here"
    two = save({"a": {"custom": [Trap(mark)]}})
    detections = write("detectron", {"0": moving(17)})
    held = dict(np.load(detections, allow_pickle=True))
    held["keypoints"][5, 1] = Trap(mark)
    np.savez_compressed(detections, **held)
    mark.unlink(missing_ok=True)
    for path in (two, detections):
        with pytest.raises(InputError, match="refused"):
            read_all(path, gives="keypoints")
    assert not mark.exists()


def test_plain_arrays_are_not_its_own(tmp_path):
    np.savez(tmp_path / "a.npz", boxes=np.zeros(3), keypoints=np.zeros(3), metadata=np.zeros(3))
    assert not detectron.sniff(tmp_path / "a.npz")
    with refused("wrong-content"):
        detectron.read(tmp_path / "a.npz")
