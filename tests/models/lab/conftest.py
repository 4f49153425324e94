"""Motion capture as small as it gets, and a ledger that is nobody's."""

import numpy as np
import pytest

from pcnet3d.models.lab.clips import Clip
from pcnet3d.models.lab.evaluation import evaluate
from pcnet3d.pipeline import rotate

SUBJECTS = {"train": "01", "val": "07", "test": "03", "hdm05": "bd", "tennis": "tennis-lvargas"}


@pytest.fixture(autouse=True)
def no_ledger_of_the_repository(monkeypatch, tmp_path):
    """Looks at test sets that tests make up are written beside their reports."""
    monkeypatch.setattr(evaluate, "ROOT", tmp_path / "installed")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.fixture
def standing(facing_camera):
    """(17, 3) the upright person in a Z-up world, facing -x there."""
    R_world_from_camera = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    return rotate(R_world_from_camera, facing_camera) + np.array([0, 0, 0.9])


@pytest.fixture
def clips(standing):
    """One clip of one person for every part of the data."""
    rng = np.random.default_rng(0)

    def of(part):
        poses = (standing + rng.normal(0, 0.03, (60, 17, 3))).astype(np.float32)
        return (Clip(f"{SUBJECTS[part]}_01", SUBJECTS[part], "asfamc", 30.0, poses),)

    return {part: of(part) for part in SUBJECTS}
