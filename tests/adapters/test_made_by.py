"""Who made the poses of a file: the file says so, the user does, or nobody."""

import numpy as np
import pytest

from golden import estimators
from golden.bodies import standing
from pcnet3d.adapters import read
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.plugins.options import option_types
from pcnet3d.pipeline.reading.load import adapters

FRAMES = 40


def test_every_adapter_of_poses_says_who_made_them_or_lets_the_user_say_it():
    silent = [
        name
        for name, adapter in adapters("poses").items()
        if not hasattr(adapter, "made_by") and "made_by" not in option_types(adapter.read)
    ]
    assert silent == []


def test_a_bvh_does_not_say_it_and_the_user_does(tmp_path):
    path = estimators.gemx_bvh(tmp_path, standing(FRAMES))
    assert read(path).made_by == MadeBy("unknown")
    assert read(path, made_by="estimated").made_by == MadeBy("estimated")
    assert read(path, made_by="measured").made_by.kind == "measured"
    with pytest.raises(InputError, match="made_by"):
        read(path, made_by="guessed")


def test_amass_is_motion_capture_by_its_own_words_alone(tmp_path):
    """WHAM's joints in AMASS's form have a frame rate, and none of motion capture."""
    joints = standing(FRAMES).astype(np.float32)
    own = {"poses": np.zeros((FRAMES, 156)), "trans": np.zeros((FRAMES, 3)), "betas": np.zeros(16)}
    np.savez(tmp_path / "amass.npz", joints=joints, mocap_framerate=30.0, **own)
    np.savez(tmp_path / "wham.npz", joints=joints, fps=30.0)
    assert read(tmp_path / "amass.npz").made_by.kind == "measured"
    assert read(tmp_path / "wham.npz").made_by.kind == "unknown"
    assert read(estimators.soma(tmp_path, joints), fps=30).made_by.kind == "unknown"
