"""The numbered film and its detector, made once."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from golden import numbered


@pytest.fixture(scope="session")
def joints_px() -> np.ndarray:
    """(60, 17, 2) the walker's COCO joints in the video."""
    return numbered.joints_px()


@pytest.fixture(scope="session")
def numbered_film(tmp_path_factory) -> Path:
    return numbered.numbered_film(tmp_path_factory.mktemp("film") / "numbered.ts")


@pytest.fixture(scope="session")
def toy_detector(tmp_path_factory) -> Path:
    return numbered.toy_detector(tmp_path_factory.mktemp("toy") / "toy.onnx")
