"""What bodies state of up, along two directions."""

import numpy as np

from pcnet3d.models.gravity.votes import OWN_LEAN_DEG, pitch_roll_error_deg


def stated_deg(up, error_deg) -> np.ndarray:
    """(2,) of the pitch and the roll of an up (3,) whose votes ask for such an error, of who may face anywhere."""
    return np.sqrt(np.square(pitch_roll_error_deg(up, error_deg)) + OWN_LEAN_DEG**2 / 2)
