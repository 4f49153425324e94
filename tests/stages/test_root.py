"""The pelvis's place goes with the poses where the source truly knows it, and nowhere else."""

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import aimed
from pcnet3d.pipeline import CAMERA, H36M17, Z_UP, InputError, PoseSequence, change_frame
from pcnet3d.pipeline.core.conversions import remap
from pcnet3d.pipeline.core.frames import GL_CAMERA
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.pose import RootPath
from pcnet3d.pipeline.reading.findings import repaired

PELVIS = H36M17.index("pelvis")


@pytest.fixture(scope="module")
def camera(walk):
    return aimed(walk.root.mean(axis=0), 5, heading_deg=60, pitch_deg=20, roll_deg=0)


def in_camera(walk, camera, **frame) -> PoseSequence:
    return walk.poses.with_(joints=camera.points(walk.world), frame=CAMERA.with_(origin="camera", **frame))


def test_taking_the_pelvis_off_keeps_its_place_in_the_new_axes_and_unit(walk, camera):
    millimetres = in_camera(walk, camera, unit="mm")
    millimetres = millimetres.with_(joints=millimetres.joints * 1000)
    found = change_frame(millimetres, GL_CAMERA)
    np.testing.assert_allclose(found.root, camera.points(walk.root[:, None])[:, 0] * [1, -1, -1], atol=1e-5)
    np.testing.assert_allclose(found.joint("pelvis"), 0)
    back = change_frame(found, CAMERA)
    np.testing.assert_allclose(back.joints + back.root[:, None], camera.points(walk.world), atol=1e-5)


@pytest.mark.parametrize("what", ["still", "at the origin", "no scale", "another origin", "behind"])
def test_a_place_that_says_nothing_is_none(walk, camera, what):
    seen = in_camera(walk, camera)
    centred = seen.joints - seen.joints[:, [PELVIS]]
    jitter = np.random.default_rng(0).normal(scale=0.03, size=(len(walk), 1, 3))
    changed = {
        "still": seen.with_(joints=centred + np.float32([0, 0, 4])),
        "at the origin": seen.with_(joints=centred + jitter),  # as lifters of metres leave it
        "no scale": in_camera(walk, camera, unit="arbitrary"),
        "another origin": seen.with_(frame=CAMERA.with_(origin="crop centre")),
        "behind": seen.with_(joints=-seen.joints),
    }[what]
    assert change_frame(seen, CAMERA).root is not None
    assert change_frame(changed, changed.frame.with_(origin="pelvis")).root is None


def test_missing_places_are_nan(walk):
    joints = walk.poses.joints.copy()
    joints[3:5, PELVIS] = np.nan
    root = change_frame(walk.poses.with_(joints=joints), Z_UP.with_(origin="pelvis")).root
    assert np.flatnonzero(np.isnan(root).any(axis=1)).tolist() == [3, 4]


@pytest.mark.parametrize("rows", [3, 5])
def test_a_root_of_another_length_is_refused(rows):
    with pytest.raises(InputError, match=r"path of shape \(4, 3\)"):
        PoseSequence(np.zeros((4, 17, 3)), H36M17, CAMERA, path=RootPath(np.zeros((rows, 3))))


def test_remapping_keeps_it_and_a_mirror_mirrors_it(walk, camera):
    seen = change_frame(in_camera(walk, camera), CAMERA)
    mirrored = repaired(seen, "mirror")
    np.testing.assert_array_equal(mirrored.root, seen.root * [-1, 1, 1])
    named = seen.with_(joints=seen.joints[:, : len(COCO17)], layout=COCO17)  # any names
    np.testing.assert_array_equal(remap(named, H36M17).root, seen.root)
