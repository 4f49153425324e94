"""The example's files, read back the way a user's files are read, say what the walker did."""

import av
import numpy as np

from pcnet3d.adapters import read
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.files import UNDETECTED, write_files, write_keypoints, write_poses
from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.layouts import HALPE26


def rng() -> np.random.Generator:
    return np.random.default_rng(1)


def seen(walk: Walk) -> np.ndarray:
    return np.setdiff1d(np.arange(len(walk)), UNDETECTED)


def test_keypoints_without_noise_are_the_projection(tmp_path, walk, camera):
    path, rows = tmp_path / "alphapose-results.json", seen(walk)
    write_keypoints(path, walk, camera, rows, 0.0, rng())
    keypoints = read(path, gives="keypoints")
    assert keypoints.layout == HALPE26
    np.testing.assert_array_equal(keypoints.frame_index, rows)
    np.testing.assert_allclose(keypoints.joints, camera.project(halpe26(walk))[rows], atol=2e-3)
    assert 0.5 < keypoints.confidence.min() <= keypoints.confidence.max() <= 1


def test_poses_without_noise_are_the_truth_in_a_unit_that_follows_the_distance(tmp_path, walk, camera):
    path, rows = tmp_path / "X3D.npy", seen(walk)
    write_poses(path, walk, camera, rows, 0.0, rng())
    poses = read(path, gives="poses")
    truth = camera_poses(walk, camera).joints[rows]
    size = np.linalg.norm(poses.joints, axis=(1, 2)) / np.linalg.norm(truth, axis=(1, 2))
    np.testing.assert_allclose(poses.joints, truth * size[:, None, None], atol=1e-5)
    distance = camera.points(walk.root[rows][:, None])[:, 0, 2]
    np.testing.assert_allclose(size * distance, size[0] * distance[0], rtol=1e-5)


def test_the_video_shows_the_take(tmp_path):
    walk = walker(seconds=4)
    camera = side_camera(walk)
    files = write_files(tmp_path / "input", walk, camera)
    assert files.video.stat().st_size < 150_000
    with av.open(str(files.video)) as container:
        stream = container.streams.video[0]
        assert stream.codec_context.name == "h264"
        assert not stream.codec_context.has_b_frames
        frames = list(container.decode(stream))
    assert len(frames) == len(walk)
    np.testing.assert_allclose([float(frame.time) for frame in frames], walk.time_s, atol=1e-4)
    # Joints of the near side are painted in its colour exactly where they project to, in every part of the take.
    pixels = camera.project(walk.world)
    for row in (5, 40, 75, 105):
        image = frames[row].to_ndarray(format="rgb24").astype(int)
        assert image.shape == (360, 640, 3)
        for joint in ("r_knee", "r_elbow"):
            x, y = np.round(pixels[row, H36M17.index(joint)]).astype(int)
            red, _, blue = image[y, x]
            assert red - blue > 60, (row, joint)
