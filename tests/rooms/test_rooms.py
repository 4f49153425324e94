"""The images that gravity from images is tested on: their truth is what the pixels show."""

import numpy as np

from pcnet3d.pipeline.core.camera import view_rotation
from rooms import street


def test_truth_is_what_its_angles_say():
    shown = street(4)
    R = view_rotation(np.array(0.0), np.array(shown.pitch_deg), np.array(shown.roll_deg))
    np.testing.assert_allclose(shown.camera.up, R[:, 2], atol=1e-9)
