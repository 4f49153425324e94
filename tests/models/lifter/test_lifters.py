"""Lifters of other people: recognised, run and refused; tiny networks stand in for them."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pcnet3d.models import load_lifter
from pcnet3d.models.lifter.features import ray_rotation
from pcnet3d.models.lifter.sequence import SequenceLifter, from_ray
from pcnet3d.pipeline import H36M17, InputError, remap
from pcnet3d.pipeline.core.layouts import COCO17, HALPE26
from pcnet3d.pipeline.core.lifted import ToLift
from pcnet3d.pipeline.core.rotations import rotate
from refusals import refused

SIZE = (1920, 1080)
FLAT = [[1, 0, 0], [0, 1, 0], [0, 0, 0]]  # x and y as they are, the confidence dropped
DEPTH = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]  # the confidence as depth


def lifted_by(lifter, keypoints, *asked, **more):
    """What a lifter or the network in a file makes of the keypoints, with its history."""
    lifter = load_lifter(lifter) if isinstance(lifter, str) else lifter
    return lifter.lift(ToLift(keypoints, *asked, **more)).noted()


def relative(pixels):
    return pixels - pixels[:, :1]


def test_motionbert_s_crop_comes_back_as_x_and_y(per_frame, swaying):
    keypoints = swaying(60, confidence=np.full((60, 17), 0.5))
    lifted = lifted_by(per_frame(FLAT), keypoints, SIZE)
    side = np.ptp(keypoints.joints.reshape(-1, 2), axis=0).max()
    assert_allclose(lifted.joints[..., :2], relative(keypoints.joints) / (side / 2), atol=1e-4)
    assert_allclose(lifted.joints[..., 2], 0, atol=1e-6)
    assert (lifted.frame.name, lifted.frame.unit, lifted.frame.origin) == ("CAMERA", "arbitrary", "pelvis")
    said = lifted.history[-1].options
    assert said["kind"] == "motionbert"
    assert said["model"].startswith("toy.onnx@")
    assert_allclose(lifted.confidence, 0.5)


@pytest.mark.parametrize("frames", [27, 100, 243])
def test_a_fixed_window_answers_takes_of_any_length_alike(per_frame, swaying, frames):
    matrix = np.random.default_rng(1).normal(size=(3, 3))
    open_lifter = load_lifter(per_frame(matrix, name="open.onnx"))
    fixed = load_lifter(per_frame(matrix, frames=frames))
    assert isinstance(fixed, SequenceLifter)
    assert (fixed.span.window, fixed.span.field) == (frames, None)
    for length in (1, 26, 300):
        keypoints = swaying(length)
        assert_allclose(
            lifted_by(fixed, keypoints, SIZE).joints,
            lifted_by(open_lifter, keypoints, SIZE).joints,
            atol=1e-5,
        )


@pytest.mark.parametrize(("field", "frames"), [(9, None), (9, 9), (9, 60), (243, None), (300, None)])
def test_videopose3d_s_receptive_field_is_found_and_padded(convolution, swaying, field, frames):
    path, kernel = convolution(field, frames)
    lifter = load_lifter(path, "videopose3d")
    assert (lifter.span.window, lifter.span.field) == (frames, field)
    keypoints = swaying(70)
    lifted = lifted_by(lifter, keypoints, SIZE)
    x = (keypoints.joints.reshape(70, 34) - np.tile([960, 540], 17)) / 960
    before = (field - 1) // 2
    padded = np.pad(x, [(before, field - 1 - before), (0, 0)], mode="edge")
    windows = np.lib.stride_tricks.sliding_window_view(padded, field, axis=0)
    expected = np.einsum("tcf,ocf->to", windows, kernel).reshape(70, 17, 3)
    assert_allclose(lifted.joints, relative(expected), atol=1e-4)
    assert lifted.frame.unit == "m"


def test_videopose3d_on_coco_joints(per_frame, coco):
    """The network sees COCO's order; what it answers is taken for Human3.6M's."""
    lifter = load_lifter(per_frame([[1, 0, 0], [0, 1, 0]]), "videopose3d-coco")
    lifted = lifted_by(lifter, coco, SIZE)
    assert_allclose(lifted.joints[..., :2], relative(coco.joints) / 960, atol=1e-5)
    halpe = remap(coco, COCO17)
    assert lifted.layout == H36M17
    with refused("wrong-content"):
        lifted_by(lifter, remap(halpe, H36M17), SIZE)


def test_detectors_joints_are_remapped(per_frame, swaying):
    keypoints = swaying(30, HALPE26)
    lifter = load_lifter(per_frame(DEPTH))
    assert_allclose(
        lifted_by(lifter, keypoints, SIZE).joints,
        lifted_by(lifter, remap(keypoints), SIZE).joints,
        atol=1e-6,
    )


def test_flip_takes_out_what_a_network_prefers_on_one_side(per_frame, swaying):
    bias = np.zeros((17, 3))
    bias[H36M17.index("l_wrist"), 0] = 0.3  # always too far to the right
    keypoints = swaying(20)
    biased = load_lifter(per_frame(FLAT, bias))
    fair = lifted_by(per_frame(FLAT, name="fair.onnx"), keypoints, SIZE).joints
    assert np.abs(lifted_by(biased, keypoints, SIZE).joints - fair).max() > 0.2
    flipped = lifted_by(biased, keypoints, SIZE, flip=True).joints
    wrists = H36M17.indices(("l_wrist", "r_wrist"))
    assert_allclose(flipped[:, wrists, 0] - fair[:, wrists, 0], [[0.15, -0.15]] * 20, atol=1e-5)


def test_missing_joints_get_no_confidence_and_are_counted(per_frame, swaying):
    keypoints = swaying(60)
    pixels = keypoints.joints.copy()
    wrist = H36M17.index("l_wrist")
    pixels[10:20, wrist] = np.nan
    lifted = lifted_by(per_frame(DEPTH), keypoints.with_(joints=pixels), SIZE)
    depth = lifted.joints[:, wrist, 2]
    assert_allclose(depth[10:20], -1)  # the pelvis has the confidence 1
    assert_allclose(np.delete(depth, np.s_[10:20]), 0)
    assert lifted.history[-1].options["joints_on_a_line"] == 10


def test_two_seconds_without_anybody_are_missing(per_frame, swaying):
    pixels = swaying(120).joints.copy()
    pixels[40:100] = np.nan
    lifted = lifted_by(per_frame(FLAT), swaying(pixels=pixels), SIZE)
    missing = np.isnan(lifted.joints).all(axis=(1, 2))
    assert_allclose(np.flatnonzero(missing), np.arange(40, 100))
    assert lifted.history[-1].options["frames_without_joints"] == 60


def test_from_ray_undoes_looking_along_the_ray():
    rng = np.random.default_rng(0)
    rays = rng.uniform(-0.5, 0.5, (10, 2))
    joints = rng.normal(size=(10, 17, 3))
    seen = rotate(np.swapaxes(ray_rotation(rays), -1, -2), joints)
    turned, said = from_ray(seen, rays * 1500 + np.array(SIZE) / 2, np.array(SIZE), 1500)
    assert_allclose(turned, joints, atol=1e-12)
    assert said["focal_px"] == 1500


def test_a_crop_s_answer_is_turned_by_the_ray_when_the_focal_length_is_known(per_frame, swaying):
    keypoints = swaying(5)
    lifter = load_lifter(per_frame(DEPTH))
    straight, turned = (
        lifted_by(lifter, keypoints, SIZE),
        lifted_by(lifter, keypoints, SIZE, focal_px=800.0),
    )
    said = straight.history[-1].options
    least, most = said["bearing_deg"]
    assert 0 < least <= most < 20
    assert not said["focal_known"]
    assert not np.allclose(straight.joints, turned.joints, atol=1e-2)
    lengths = [np.linalg.norm(poses.joints, axis=-1) for poses in (straight, turned)]
    assert_allclose(*lengths, atol=1e-5)


def test_a_whole_image_s_answer_is_not_turned(per_frame, swaying):
    lifter = load_lifter(per_frame(FLAT), "motionbert-pixel")
    a, b = (lifted_by(lifter, swaying(5), SIZE, focal_px=focal) for focal in (None, 800.0))
    np.testing.assert_array_equal(a.joints, b.joints)
    assert "bearing_deg" not in a.history[-1].options
    assert_allclose(a.joints[..., :2], relative(swaying(5).joints) / 540, atol=1e-5)


def test_the_built_in_lifter():
    assert load_lifter().method.startswith("pcnet3d@")


def test_what_does_not_say_its_kind_has_to_be_told(per_frame, convolution):
    for path in (per_frame([[1, 0, 0], [0, 1, 0]], frames=243), convolution(9)[0]):
        with pytest.raises(InputError, match=r"lift\.lifter_kind"):
            load_lifter(path)


@pytest.mark.parametrize(
    ("name", "kind", "words"),
    [
        ("motionbert", None, "no lifter 'motionbert'; known are pcnet3d.*as its .onnx file"),
        ("pcnet3d", "motionbert", "kind pcnet3d, not motionbert"),
        ("pcnet3d", "motionbret", "did you mean motionbert"),
        ("nowhere.onnx", None, "nowhere.onnx: No such file"),
    ],
)
def test_unknown_names_and_kinds(name, kind, words):
    with pytest.raises(InputError, match=words):
        load_lifter(name, kind)


def test_networks_of_another_kind(per_frame, tmp_path):
    text = tmp_path / "text.onnx"
    text.write_text("no network")
    with pytest.raises(InputError, match=r"Expected a lifter in an \.onnx file"):
        load_lifter(str(text))
    with pytest.raises(InputError, match="lifts sequences of keypoints, not pcnet3d"):
        load_lifter(per_frame(FLAT), "pcnet3d")


def test_a_rectifier_is_no_lifter():
    from importlib.resources import files

    with pytest.raises(InputError, match=r"pcnet.onnx is not a lifter: expected keypoints .* got inputs"):
        load_lifter(str(files("pcnet3d.models.rectifier").joinpath("pcnet.onnx")))
