"""The configs of trainings as small as they get: of the rectifier and of the lifter."""

from pathlib import Path

import numpy as np

from pcnet3d.models.lab.clips import Clip
from pcnet3d.pipeline import H36M17

TINY = Path(__file__).with_name("tiny.toml").read_text(encoding="utf-8")
LIFTER = Path(__file__).with_name("tiny_lifter.toml").read_text(encoding="utf-8")


def tiny(*changes: tuple[str, str], text: str = TINY) -> str:
    """tiny.toml, or another text, with pieces of it replaced: (before, after) each."""
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after)
    return text


def three_people():
    """Three people of other proportions, who hardly move."""
    rng = np.random.default_rng(0)
    poses = rng.uniform([-0.4, -0.4, 0], [0.4, 0.4, 1.8], (3, 1, 17, 3)) + rng.normal(
        0, 0.01, (3, 150, 17, 3)
    )
    poses[:, :, 0] = poses[:, :, H36M17.indices(("l_hip", "r_hip"))].mean(axis=2)
    return tuple(
        Clip(f"0{i}_01", f"0{i}", "asfamc", 30.0, joints.astype(np.float32)) for i, joints in enumerate(poses)
    )
