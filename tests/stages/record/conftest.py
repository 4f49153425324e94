"""A take of a simple moving person whose rotations are known, its videos, and a reader of recordings."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.films import film_of
from golden.recordings import Recording
from pcnet3d.pipeline import CAMERA, H36M17, IMAGE, LEVEL, PoseSequence, Rectified, Take, Video, rotate
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.stages.record.stage import record

ROWS, FIRST, FPS = 12, 5, 25
UPRIGHT = np.array(
    [[0, -1, 0], [0, 0, -1], [1, 0, 0]], float
)  # R_camera_from_body of a person facing the camera
STANDING = {
    "r_hip": (0, 0.1, 0), "r_knee": (0, 0.1, -0.45), "r_ankle": (0, 0.1, -0.9),
    "l_hip": (0, -0.1, 0), "l_knee": (0, -0.1, -0.45), "l_ankle": (0, -0.1, -0.9),
    "spine": (0, 0, 0.25), "thorax": (0, 0, 0.5), "nose": (-0.1, 0, 0.6), "head": (0, 0, 0.75),
    "l_shoulder": (0, -0.2, 0.5), "l_elbow": (0, -0.25, 0.2), "l_wrist": (-0.2, -0.25, 0.1),
    "r_shoulder": (0, 0.2, 0.5), "r_elbow": (0, 0.25, 0.2), "r_wrist": (-0.2, 0.25, 0.1),
}  # fmt: skip


@pytest.fixture(scope="session")
def make_take() -> Callable[..., Take]:
    """make_take(rows=12): frames 5, 6, ... of a 25 fps video; the person nods by known angles, and so do the votes."""

    def make(rows: int = ROWS) -> Take:
        time_s = (FIRST + np.arange(rows)) / FPS
        body = np.tile([STANDING.get(joint, (0, 0, 0)) for joint in H36M17.joints], (rows, 1, 1)).astype(
            float
        )
        body[:, H36M17.index("r_wrist"), 2] += 0.3 * np.sin(2 * np.pi * time_s)
        R_level_from_body = Rotation.from_euler(
            "y", np.linspace(0, 30, rows)[:, None], degrees=True
        ).as_matrix()
        clock = {"time_s": time_s, "frame_index": FIRST + np.arange(rows)}
        R_source_from_body = UPRIGHT @ R_level_from_body
        pixels = 40 + 20 * np.random.default_rng(0).random((rows, len(COCO17), 2))
        rectified = Rectified(
            level=PoseSequence(rotate(R_level_from_body, body), H36M17, LEVEL, **clock),
            R_source_from_body=R_source_from_body,
            R_source_from_level=UPRIGHT,
            error_deg=np.full(rows, np.nan),
            method="geometric",
            level_heading="median",
            up_error_deg=np.full(rows, 3.0),
            up_bound_deg=np.full(rows, 5.0),
            up_votes=R_source_from_body[:, :, 2],
            up_shares={"frames": 0.75, "feet": 0.25},
        )
        return Take(
            name="nodding",
            poses=PoseSequence(rotate(R_source_from_body, body), H36M17, CAMERA, **clock),
            keypoints=PoseSequence(pixels, COCO17, IMAGE, **clock),
            rectified=rectified,
        )

    return make


@pytest.fixture
def film(tmp_path: Path) -> Callable[..., Video]:
    """film(codec="libx264", name="film.mp4", size=(64, 48), time_ms=..., bf=0, group=12, **options of the codec): a
    bright spot that moves right, 8 pixels a frame, in the upper half of the image; key frames are `group` frames
    apart."""

    def make(
        codec: str = "libx264",
        name: str = "film.mp4",
        size: tuple[int, int] = (64, 48),
        time_ms=tuple(range(0, 800, 40)),
        bf: int = 0,
        group: int = 12,
        **options: str,
    ) -> Video:
        path, (width, height), images = tmp_path / name, size, []
        for i in range(len(time_ms)):
            image = np.zeros((height, width, 3), np.uint8)
            image[2:10, 8 * i % width :][:, :8] = 255
            images.append(image)
        film_of(path, images, time_ms, codec, bf=bf, g=group, **options)
        name = {"libx264": "h264", "libx265": "hevc", "libvpx-vp9": "vp9"}.get(codec, codec)
        return Video(path, width, height, np.array(time_ms) / 1000, name)

    return make


@pytest.fixture
def read_back(tmp_path: Path) -> Callable[[Take], Recording]:
    """read_back(take): its recording."""

    def make(take: Take) -> Recording:
        record(take, tmp_path / "take.rrd")
        return Recording(tmp_path / "take.rrd")

    return make


@pytest.fixture(scope="session")
def as_it_is(make_take, tmp_path_factory) -> tuple[Take, Recording]:
    """The take and its recording."""
    path = tmp_path_factory.mktemp("recording") / "take.rrd"
    record(make_take(), path)
    return make_take(), Recording(path)


@pytest.fixture
def taken(make_take, read_back, as_it_is):
    """taken(**changes): the take with these changes, and its recording read back."""

    def make(frames: bool = True, **changes):
        if frames and not changes:
            return as_it_is
        take = make_take().with_(**changes).telling(images=frames)
        return take, read_back(take)

    return make
