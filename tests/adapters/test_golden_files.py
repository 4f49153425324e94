"""Every golden file comes back as the people who were written into it."""

import numpy as np
import pytest

from golden.bodies import Person, limbs_of, standing, turning
from golden.catalogue import CATALOGUE, Golden, recognised
from golden.detections import between_shoulders
from pcnet3d.adapters import read_all
from pcnet3d.pipeline import Z_UP, PoseSequence, change_frame
from pcnet3d.pipeline.core.layouts import OPENPOSE18

OTHERWISE = (  # written from other people, and tested by themselves
    "the same of BODY_25B",
    "`.npy` of (frames, 17, 3), of no known lifter", "RTMW3D's `results_<video>.json`",
)  # fmt: skip
OF_PEOPLE = [
    golden
    for golden in CATALOGUE
    if golden.adapter not in ("video", "imu_csv") and golden.form not in OTHERWISE
]
# Recognised by these too, which come second: a file of AlphaPose or OpenPose holds 2D and 3D, a vis.py's folder both.
BESIDE = {"json2d", "vis2d"}


def called(golden: Golden) -> str:
    return f"{golden.adapter}: {golden.form}"


@pytest.fixture
def people(tmp_path):
    """people(golden): everybody who is read from it."""

    def of(golden: Golden) -> tuple[PoseSequence, ...]:
        path = golden.write(Person(), tmp_path)
        if not golden.by_name:
            assert set(recognised(path)) - BESIDE <= {golden.adapter}
        return read_all(path, golden.adapter if golden.by_name else "auto", missing="gap", **golden.options)

    return of


def shows(poses: PoseSequence, begin: int) -> bool:
    """Whether 3D poses are the person of the golden files, who is the second one or the same who stands elsewhere.
    begin: the file's first frame."""
    made, frames = turning, poses.frame_index
    if poses.frame.family == "world":
        made, poses = standing, change_frame(poses, Z_UP.with_(origin="pelvis", unit=poses.frame.unit))
    body, truth = limbs_of(poses.joints), limbs_of(made(300))
    there = np.isfinite(body).all(axis=(1, 2))
    assert there.mean() > 0.9
    return any(
        np.allclose(body[there], truth[rows][there], atol=1e-4)
        for rows in (frames - begin, frames - frames[0] + 200)
    )


@pytest.mark.parametrize("golden", OF_PEOPLE, ids=called)
def test_people_come_back_as_they_were_written(people, golden):
    everybody = people(golden)
    for number, poses in enumerate(everybody):
        if poses.frame.dims == 3:
            assert shows(poses, everybody[0].frame_index[0])
        else:
            scene = Person().two_in_images(poses.layout)[str(number)]
            frames, points = between_shoulders(scene) if poses.layout == OPENPOSE18 else scene
            np.testing.assert_allclose(poses.joints, points[..., :2], atol=0.02)
            np.testing.assert_array_equal(poses.frame_index, frames)
            scored = np.isfinite(poses.confidence)
            np.testing.assert_allclose(poses.confidence[scored], points[..., 2][scored], atol=1e-5)
