"""What trains is made by torch, what is judged and run by numpy: functions that take both say the same of both."""

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from pcnet3d.models.common.vectors import rotate as rotated  # noqa: E402
from pcnet3d.models.lab.synthetic import bodies, cameras  # noqa: E402
from pcnet3d.models.lab.synthetic import keypoint_noise as noise2d  # noqa: E402
from pcnet3d.models.lab.synthetic.on_device import keypoint_noise as t_noise  # noqa: E402
from pcnet3d.models.lab.synthetic.on_device import poses as t_poses  # noqa: E402
from pcnet3d.models.lab.synthetic.on_device.draw import Draw  # noqa: E402
from pcnet3d.models.lab.training.lifter import windows as t_features  # noqa: E402
from pcnet3d.models.lifter import features as lifter_features  # noqa: E402
from pcnet3d.pipeline import H36M17, rotate  # noqa: E402


@pytest.fixture
def world(rng):
    """Four windows of people who stand somewhere: (4, 12, 17, 3) metres, +Z up."""
    from golden.bodies import facing_camera

    upright = rotate(np.array([[0, 0, -1.0], [1.0, 0, 0], [0, -1.0, 0]]), facing_camera())
    moving = upright + rng.normal(0, 0.05, (4, 12, 17, 3)) + rng.uniform(-2, 2, (4, 1, 1, 3)) + [0, 0, 1.0]
    return moving.astype(np.float64)


def tensor(x):
    return torch.from_numpy(np.ascontiguousarray(x))


def same(a, b, tolerance=1e-6):
    np.testing.assert_allclose(np.asarray(a), b, atol=tolerance, rtol=tolerance)


def test_bodies(rng, world):
    factors = rng.uniform(0.8, 1.2, (4, 17))
    same(bodies.resize(tensor(world), tensor(factors)), bodies.resize(world, factors))
    same(bodies.mirror(tensor(world)), bodies.mirror(world))
    same(bodies.size_m(tensor(world)), bodies.size_m(world))


def test_cameras(rng, world):
    placed = cameras.place(world, rng)
    one = cameras.Cameras(
        *map(tensor, (placed.R_camera_from_world, placed.position, placed.focal_px, placed.image_size))
    )
    joints = placed.to_camera(world)
    same(one.to_camera(tensor(world)), joints)
    same(one.project(tensor(joints)), placed.project(joints))


def test_what_hides_joints_and_profiles(rng, world):
    joints = cameras.place(world, rng).to_camera(world)
    hidden = noise2d.hidden_joints(joints)
    assert hidden.any()
    assert not hidden.all()
    same(noise2d.hidden_joints(tensor(joints)), hidden)
    for cosine in (0.3, 0.85):
        same(noise2d.in_profile(tensor(joints), cosine), noise2d.in_profile(joints, cosine))


def test_features_of_keypoints_with_gaps(rng, world):
    placed = cameras.place(world, rng)
    keypoints = placed.project(placed.to_camera(world))
    keypoints[rng.uniform(size=keypoints.shape[:-1]) < 0.2] = np.nan
    keypoints[1, :3] = np.nan  # nobody at the start
    keypoints[2, 5:8] = np.nan  # nor in the middle
    keypoints[3, 4, :, 1] = np.nan
    confidence = rng.uniform(size=keypoints.shape[:-1])
    confidence[0] = np.nan
    up = rng.normal(size=(*keypoints.shape[:2], 3))
    up /= np.linalg.norm(up, axis=-1, keepdims=True)
    up[0] = np.nan  # unknown
    up[1, 4] = [0, 0, 1]  # along the ray
    given = keypoints, confidence, placed.image_size, placed.focal_px, up
    x, R = lifter_features.features(*given)
    made_x, made_R = lifter_features.features(*map(tensor, given))
    same(made_x, x, 1e-5)
    same(made_R, R)
    assert x.shape[-1] == lifter_features.CHANNELS


def test_the_target_is_the_skeleton_seen_along_its_ray(rng):
    joints = rng.normal([1.0, -0.5, 4.0], 0.3, (2, 9, 17, 3))
    answer, velocity = (
        np.asarray(part) for part in t_features.target(tensor(joints), tensor(np.full((2, 1, 3), np.nan)))
    )
    R_camera_from_ray = lifter_features.body_rays(joints)
    back = rotate(R_camera_from_ray, answer)
    relative = joints - joints[:, :, :1]
    scale = bodies.STANDARD_SIZE_M / bodies.size_m(relative)[:, None, None, None]
    same(back, relative * scale)
    same(rotate(R_camera_from_ray, velocity), np.gradient(relative * scale, axis=1))


def test_keypoints_made_of_others_are_those_of_coco(rng):
    keypoints, height = rng.uniform(0, 100, (2, 3, 17, 2)), np.array([0.5, 0.8])
    made = np.asarray(noise2d.derive(tensor(keypoints), tensor(height)[:, None, None]))
    same(made, noise2d.derive(keypoints, height[:, None, None]))


def test_rotations(rng):
    from scipy.spatial.transform import Rotation

    vectors = np.concatenate([rng.normal(0, 2, (50, 3)), np.zeros((1, 3)), [[1e-9, 0, 0]]])
    same(t_poses.from_vector(tensor(vectors)), Rotation.from_rotvec(vectors).as_matrix())
    R, x = Rotation.random(5, random_state=1).as_matrix(), rng.normal(size=(5, 17, 3))
    same(rotated(tensor(R), tensor(x)), rotate(R, x))


def test_noise_is_as_large_as_the_formula_says():
    """Jitter, errors and gaps of both over many windows of a person who stands still."""
    from golden.bodies import facing_camera

    joints = np.broadcast_to(facing_camera() + np.array([0, 0, 4.0]), (400, 30, 17, 3)).astype(np.float32)
    pixels = joints[..., :2] / joints[..., 2:] * 1000 + 500
    a, trust_a = noise2d.detect(pixels, joints, np.random.default_rng(0))
    b, trust_b = (
        np.asarray(part)
        for part in t_noise.detect(tensor(pixels), tensor(joints), Draw(0, 0), t_noise.Spoilt(), 30.0)
    )

    def figures(keypoints, trust):
        error = keypoints - pixels
        gone = np.isnan(error[..., 0])
        parts = [
            np.nanquantile(np.abs(part), 0.7, axis=(0, 1, 3)) for part in (error, np.diff(error, axis=1))
        ]
        return np.concatenate(parts), gone.mean(), trust[~gone].mean()

    (spread_a, gone_a, mean_a), (spread_b, gone_b, mean_b) = figures(a, trust_a), figures(b, trust_b)
    np.testing.assert_allclose(spread_b, spread_a, rtol=0.12)
    assert gone_b == pytest.approx(gone_a, rel=0.3)
    assert mean_b == pytest.approx(mean_a, abs=0.01)


def test_layouts_agree():
    assert sorted(bodies.CHILDREN) == [i for i in range(17) if H36M17.joints[i] != "pelvis"]
    assert H36M17.joints[bodies.PARENTS[bodies.CHILDREN.index(H36M17.index("l_ankle"))]] == "l_knee"
