"""A camera's up, and what bodies state of it along two directions."""

import numpy as np

from pcnet3d.models.gravity.evidence import TakeUp, fuse
from pcnet3d.models.gravity.votes import OWN_LEAN_DEG, of_votes, pitch_roll_error_deg, pool
from pcnet3d.pipeline.core.camera import view_rotation


def up_of(pitch: float, roll: float = 0.0) -> np.ndarray:
    """(3,) of a camera that looks down by pitch, turned by roll, degrees."""
    return view_rotation(np.array(0.0), np.array(float(pitch)), np.array(float(roll)))[:, 2]


def stated_deg(up, error_deg) -> np.ndarray:
    """(2,) of the pitch and the roll of an up (3,) whose votes ask for such an error, of who may face anywhere."""
    return np.sqrt(np.square(pitch_roll_error_deg(up, error_deg)) + OWN_LEAN_DEG**2 / 2)


def take_up(up, error_deg, time_s, others=()) -> TakeUp:
    """Votes (T, 3), of frames that expect such errors (T,), fused with other evidence."""
    return fuse([*others, *of_votes(pool(up, error_deg, time_s))])
