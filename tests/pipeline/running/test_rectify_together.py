"""Several people of one recording in one LEVEL (design.md section 4)."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.ups import stated_deg
from pcnet3d.models.gravity.votes import LEAN_DEG
from pcnet3d.pipeline import GL_CAMERA, InputError, Take, change_frame, rotate
from pcnet3d.pipeline.core.pose import Rectified
from pcnet3d.pipeline.core.rotations import angle_deg
from pcnet3d.pipeline.core.take import Told
from pcnet3d.stages import rectify
from pcnet3d.stages.rectify import Rectify


def rectify_together(people, rectifier: str = "pcnet", **told) -> list[Rectified]:
    takes = [Take(str(i), poses=poses, told=Told(**told)) for i, poses in enumerate(people)]
    return [take.need("rectified") for take in Rectify(rectifier).together(takes)]


def headings_deg(rectified) -> np.ndarray:
    """(T,) where each frame's body faces in LEVEL, counted to the left from -X."""
    R_level_from_body = rectified.R_source_from_level.T @ rectified.R_source_from_body
    return np.degrees(np.arctan2(R_level_from_body[:, 1, 0], R_level_from_body[:, 0, 0]))


def wrapped(angle: np.ndarray) -> np.ndarray:
    return (angle + 180) % 360 - 180


@pytest.fixture(scope="module", params=["pcnet", "geometric"])
def both(scene, request):
    return rectify_together(scene.poses, request.param)


def test_other_camera_axes_give_the_same_level(scene, both):
    other = [change_frame(poses, GL_CAMERA) for poses in scene.poses]
    method = "geometric" if "geometric" in both[0].method else "pcnet"
    for a, b in zip(both, rectify_together(other, method), strict=True):
        np.testing.assert_allclose(a.level.joints, b.level.joints, atol=1e-4)


def test_one_level_whose_back_is_against_the_cameras_view(scene, both):
    first, second = both
    np.testing.assert_array_equal(first.R_source_from_level, second.R_source_from_level)
    back, right, up = first.R_source_from_level.T
    assert angle_deg(up, scene.camera.up) < first.up_bound_deg[0]
    assert back[2] > 0.8  # along the view (0, 0, 1), lifted to the horizon
    np.testing.assert_allclose(right @ [0, 0, 1], 0, atol=1e-9)
    assert first.level_heading == second.level_heading == "camera"
    assert first.level_ok
    assert second.level_ok


def test_who_faces_where_against_each_other_is_right(scene, both):
    first, second = both
    later = len(first.body) - len(second.body)
    apart = wrapped(headings_deg(second) - headings_deg(first)[later:] - scene.heading_deg())
    assert np.abs(np.median(apart)) < 4
    assert np.percentile(np.abs(apart), 90) < 10


def test_the_pooled_up_is_no_surer_than_the_surest_person(scene, both):
    alone = [rectify(poses, "pcnet" if "pcnet" in both[0].method else "geometric") for poses in scene.poses]
    surest = min(one.up_error_deg[0] for one in alone)
    for rectified in both:
        assert rectified.up_error_deg[0] == pytest.approx(surest)
    for one in alone:  # what a lifter leans with all its frames, in pitch and in roll, less what feet tell
        up, bodies_deg = one.up_own["frames"]
        assert bodies_deg >= np.hypot(*stated_deg(up, LEAN_DEG)) - 1e-9
    assert both[0].up_shares.keys() == {"person 0", "person 1"}
    assert sum(both[0].up_shares.values()) == pytest.approx(1)


def test_one_person_is_several_of_whom_there_is_one(scene):
    (one,) = rectify_together(scene.poses[:1], "geometric")
    alone = rectify(scene.poses[0], "geometric")
    assert one.level_heading == alone.level_heading != "camera"
    np.testing.assert_array_equal(one.R_source_from_level, alone.R_source_from_level)
    np.testing.assert_array_equal(one.level.joints, alone.level.joints)


def test_who_lies_takes_the_others_up_and_has_no_say(scene):
    over = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    lying = scene.poses[1].with_(joints=rotate(over, scene.poses[1].joints))
    assert not rectify(lying, "geometric").level_ok
    (alone,) = rectify_together(scene.poses[:1], "geometric")
    standing, laid = rectify_together((scene.poses[0], lying), "geometric")
    np.testing.assert_allclose(
        standing.R_source_from_level[:, 2], alone.R_source_from_level[:, 2], atol=1e-12
    )
    np.testing.assert_array_equal(laid.R_source_from_level, standing.R_source_from_level)
    assert laid.level_ok
    assert laid.up_shares.keys() == {"person 0"}
    trunk = laid.level.joint("thorax") - laid.level.joint("pelvis")
    assert angle_deg(trunk, np.array([0.0, 0.0, 1.0])).min() > 50


def test_when_all_lie_nobody_is_called_level(scene):
    over = Rotation.from_euler("z", 90, degrees=True).as_matrix()
    lying = [poses.with_(joints=rotate(over, poses.joints)) for poses in scene.poses]
    for rectified in rectify_together(lying, "geometric"):
        assert "from the image's" in rectified.level_reason
    told = rectify_together(lying, "geometric", gravity=tuple(-scene.camera.up))
    assert all(rectified.level_ok for rectified in told)
    np.testing.assert_allclose(told[0].R_source_from_level[:, 2], scene.camera.up, atol=1e-6)


def test_what_is_told_of_the_camera_counts_for_all(scene):
    for rectified in rectify_together(scene.poses, "geometric", pitch_deg=25, roll_deg=8):
        assert angle_deg(rectified.R_source_from_level[:, 2], scene.camera.up) < 1
        assert rectified.up_error_deg[0] < 1.1
        assert rectified.up_shares["camera pitch and roll"] > 0.8
        assert sum(rectified.up_shares.values()) == pytest.approx(1)


def test_a_moving_camera_gives_a_common_heading_only(scene):
    for rectified in rectify_together(scene.poses, "geometric", camera="moving"):
        assert rectified.R_source_from_level.shape == (len(rectified.body), 3, 3)
        assert rectified.level_heading == "camera"


def test_a_world_that_knows_gravity_is_everybodys_level(scene):
    people = [walk.poses for walk in scene.walks]
    for rectified, walk in zip(rectify_together(people), scene.walks, strict=True):
        np.testing.assert_array_equal(rectified.R_source_from_level, np.eye(3))
        assert rectified.level_heading == "world"
        np.testing.assert_allclose(rectified.level.joints, walk.world - walk.world[:, :1], atol=1e-5)


def test_worlds_and_cameras_do_not_mix(scene):
    with pytest.raises(InputError, match="one frame"):
        rectify_together([scene.poses[0], scene.walks[1].poses])
