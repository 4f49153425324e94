"""The numbered film and its detector, made once."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from golden import numbered
from pcnet3d.stages.study.live.frames import Source, open_source


@pytest.fixture(scope="session")
def joints_px() -> np.ndarray:
    """(60, 17, 2) the COCO joints that the toy detector finds in the video."""
    return numbered.in_the_middle()


@pytest.fixture(scope="session")
def numbered_film(tmp_path_factory) -> Path:
    return numbered.numbered_film(tmp_path_factory.mktemp("film") / "numbered.ts")


@pytest.fixture(scope="session")
def toy_detector(tmp_path_factory) -> Path:
    return numbered.toy_detector(tmp_path_factory.mktemp("toy") / "toy.onnx")


@pytest.fixture
def camera(monkeypatch, numbered_film):
    """A camera that shows the film; `camera(change)` one whose images are changed first."""

    def shows(change):
        def shots():
            for shot in open_source(str(numbered_film)).shots:
                yield replace(shot, image=change(shot.image))

        came = Source("camera", shots(), None, waits=True)
        monkeypatch.setattr("pcnet3d.stages.study.live.command.open_source", lambda *_: came)

    shows(lambda image: image)
    return shows
