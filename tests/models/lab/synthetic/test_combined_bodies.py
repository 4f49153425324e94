"""The legs of one motion under the upper body of another."""

import numpy as np
import pytest

from pcnet3d.pipeline import H36M17

torch = pytest.importorskip("torch", reason="training needs torch, the extra 'train'")
from pcnet3d.models.lab.synthetic.on_device.bodies import combine  # noqa: E402

LOWER = H36M17.indices(("pelvis", "l_hip", "r_hip", "l_knee", "r_knee", "l_ankle", "r_ankle"))
UPPER = [i for i in range(17) if i not in LOWER]


@pytest.fixture
def joints(rng):
    return rng.normal([2.0, 1.0, 0.9], 0.5, (6, 9, 17, 3))


def combined(lower, upper):
    return combine(*(torch.from_numpy(np.ascontiguousarray(x)) for x in (lower, upper))).numpy()


def with_hips(joints, heading_deg):
    """Joints whose hip axis is level and points that way."""
    out = joints.copy()
    across = 0.1 * np.array([np.cos(np.radians(heading_deg)), np.sin(np.radians(heading_deg)), 0])
    for name, sign in (("l_hip", 1), ("r_hip", -1)):
        out[..., H36M17.index(name), :] = out[..., 0, :] + sign * across
    return out


def test_combined_motions_keep_the_legs_of_one_and_the_arms_of_the_other(joints, rng):
    lower, upper = with_hips(joints, 20), with_hips(rng.normal(0, 0.5, joints.shape), 110)
    out = combined(lower, upper)
    np.testing.assert_array_equal(out[..., LOWER, :], lower[..., LOWER, :])
    # The other motion's hips point 90 degrees further, so its upper body turns by -90 about the vertical.
    relative = (upper - upper[..., :1, :])[..., UPPER, :]
    expected = np.stack([relative[..., 1], -relative[..., 0], relative[..., 2]], axis=-1)
    np.testing.assert_allclose(out[..., UPPER, :] - out[..., :1, :], expected, atol=1e-9)


def test_a_motion_with_upright_hips_is_not_combined(joints, rng):
    lying = with_hips(joints, 0)
    lying[:, 4, H36M17.index("l_hip")] = lying[:, 4, 0] + [0.0, 0.0, 0.5]
    np.testing.assert_array_equal(combined(lying, with_hips(joints[::-1], 0)), lying)
