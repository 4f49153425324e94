"""vis.py's 2D: a row for every frame, scores where the repository writes them."""

import numpy as np
import pytest

from pcnet3d.adapters import read, read_all, vis2d
from pcnet3d.pipeline import InputError


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
