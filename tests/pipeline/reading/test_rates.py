"""Frame rates: refused where no camera has them, told where the file contradicts them."""

from pathlib import Path

import numpy as np
import pytest

from pcnet3d.pipeline import H36M17, LEVEL, InputError, PoseSequence, Video
from pcnet3d.pipeline.reading.bounds import check_fps, rate_doubts, timed


@pytest.mark.parametrize("fps", [0, -30, 0.5, 3000, float("nan"), float("inf")])
def test_rates_of_no_camera(fps):
    with pytest.raises(InputError, match="1 to 1000 a second"):
        check_fps(fps)


def video(fps: float, captured: float | None = None) -> Video:
    return Video(Path("clip.mp4"), 64, 48, np.arange(30) / fps, "h264", capture_fps=captured)


@pytest.mark.parametrize(
    ("given", "shown", "captured", "said"),
    [
        (None, 30, None, None),
        (30, 29.97, None, None),
        (60, 30, None, {"used_fps": 60, "source": "video", "shown_fps": 30, "times": 2}),
        (None, 30, 240, {"captured_fps": 240, "shown_fps": 30, "used_fps": 30, "times": 8}),
        (240, 30, 240, None),
        (60, 30, 240, {"used_fps": 60, "captured_fps": 240}),
        (None, 240, 240, None),
    ],
)
def test_what_the_video_says(given, shown, captured, said):
    doubts = rate_doubts(given, video(shown, captured))
    assert len(doubts) == (said is not None)
    if said:
        assert doubts[0].code == ("slow-motion-stated" if captured else "fps-contradicts")
        assert {key: doubts[0].values[key] for key in said} == pytest.approx(said)


def test_a_clock_of_the_file_that_is_contradicted_is_told():
    poses = PoseSequence(np.zeros((9, 17, 3)), H36M17, LEVEL, time_s=np.arange(9) / 30)
    (said,) = timed(poses, 60).notices
    assert (said.code, said.values["source"], said.values["shown_fps"]) == ("fps-contradicts", "file", 30)
    assert not timed(poses, 30).notices
