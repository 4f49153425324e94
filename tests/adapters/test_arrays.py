"""Bare arrays whose layout, frame and unit the caller says."""

import numpy as np
import pytest

from golden.bodies import turning
from golden.detections import AS_COCO
from golden.lifters import smoothed
from pcnet3d.adapters import arrays, read
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.layouts import LAYOUTS
from refusals import refused

FRAMES = 60
RELATIVE = turning(FRAMES)
H36M_METRES = {"layout": "H36M17", "frame": "CAMERA", "unit": "m"}


@pytest.fixture
def save(tmp_path):
    def write(only: np.ndarray | None = None, /, **named: np.ndarray):
        path = tmp_path / ("poses.npz" if named else "poses.npy")
        np.savez(path, **named) if named else np.save(path, only)
        return path

    return write


@pytest.mark.parametrize(("unit", "size"), [("mm", 1000.0), ("cm", 100.0), ("inch", 1 / 0.0254), ("m", 1.0)])
def test_lengths_become_metres(save, unit, size):
    poses = read(save(RELATIVE * size), "arrays", layout="H36M17", frame="CAMERA", unit=unit)
    np.testing.assert_allclose(poses.joints, RELATIVE, atol=1e-6)
    assert poses.frame.unit == "m"


@pytest.mark.parametrize("unit", ["arbitrary", "px"])
def test_no_length_stays_none(save, unit):
    poses = read(save(RELATIVE * 7), "arrays", layout="H36M17", frame="CAMERA", unit=unit)
    np.testing.assert_allclose(poses.joints, RELATIVE * 7, atol=1e-5)
    assert poses.frame.unit == unit


@pytest.mark.parametrize(
    ("frame", "from_camera"),
    [
        ("camera", lambda x, y, z: (x, y, z)),
        ("GL_CAMERA", lambda x, y, z: (x, -y, -z)),
        ("PC_CAMERA", lambda x, y, z: (z, -x, -y)),
    ],
)
def test_camera_axes(save, frame, from_camera):
    given = np.stack(from_camera(*np.moveaxis(RELATIVE, -1, 0)), axis=-1)
    away = np.array(from_camera(0.3, -0.2, 4.0))
    poses = read(save(given + away), "arrays", layout="H36M17", frame=frame, unit="m")
    np.testing.assert_allclose(poses.joints, RELATIVE, atol=1e-6)
    assert (poses.frame.name, poses.frame.unit, poses.frame.origin) == ("CAMERA", "m", "pelvis")


def test_world_stays_in_its_own_frame(save):
    z_up = np.stack([RELATIVE[..., 2], -RELATIVE[..., 0], -RELATIVE[..., 1]], axis=-1)
    z_up += np.array([1, 2, 0.9])
    (poses,) = arrays.read(save(z_up), layout="H36M17", frame="Z_UP", unit="m")
    np.testing.assert_allclose(poses.joints, z_up, atol=1e-6)
    assert poses.frame.family == "world"
    assert read(save(z_up), "arrays", layout="H36M17", frame="Z_UP", unit="m").frame.name == "Z_UP"


@pytest.mark.parametrize(
    ("option", "value", "says"),
    [
        *(("frame", frame, "frame of CAMERA") for frame in ("LEVEL", "BODY", "IMAGE", "WORLD", "")),
        *(("unit", unit, "unit of m, mm") for unit in ("metres", "")),
        ("layout", "H36M", "joint layout of H36M17"),
    ],
)
def test_other_frames_units_and_layouts_are_refused(save, option, value, says):
    with pytest.raises(InputError, match=f"Expected a {says}"):
        read(save(RELATIVE), "arrays", **{**H36M_METRES, option: value})


@pytest.mark.parametrize("shape", [(300, 17, 3), (1, 300, 17, 3), (300, 1, 17, 3)])
def test_an_array_of_no_known_lifter_is_read_for_what_its_body_shows(save, shape):
    """MotionBERT's output that somebody smoothed: no exact zero says whose it is."""
    path = save(smoothed(turning(300)).reshape(shape))
    poses = read(path)
    assert poses.history[0].options["adapter"] == "arrays"
    assert (poses.layout, poses.frame.name, poses.frame.unit) == (H36M17, "CAMERA", "arbitrary")
    assert [each.code for each in poses.notices] == ["array-judged"]


@pytest.mark.parametrize(("scale", "unit"), [(1, "m"), (1000, "m")])
def test_a_body_in_front_of_the_camera_is_in_its_unit(save, scale, unit):
    """MM-Fi's ground_truth.npy: metres from the camera."""
    poses = read(save(scale * (turning(297) + np.array([0.3, 0.2, 3.0]))))
    assert poses.frame.unit == unit
    np.testing.assert_allclose(poses.joints, turning(297), atol=1e-4)


@pytest.mark.parametrize(
    "change",
    [
        lambda joints: joints * [-1, 1, 1],  # mirrored
        lambda joints: joints * [-1, -1, 1],  # upside down
        lambda joints: joints[..., [0, 2, 1]] * [1, 1, -1],  # z up
        lambda joints: joints[:, AS_COCO],
        lambda joints: joints[:, ::-1],
        lambda joints: 1000 * joints,  # millimetres, or pixels
    ],
)
def test_an_array_whose_body_contradicts_is_told_why(save, change):
    path = save(change(smoothed(turning(300))))
    assert not arrays.sniff(path)
    assert arrays.lacks(path)
    with refused("format-unknown"):
        read(path)


def test_what_is_said_has_to_be_said_whole(save):
    with pytest.raises(InputError, match="needs the options frame, unit"):
        read(save(RELATIVE), "arrays", layout="H36M17")


@pytest.mark.parametrize("layout", ["H36M17_B", "H36M17_C", "COCO17", "MPI3DHP17"])
def test_other_layouts_come_back_as_h36m(save, layout):
    """Limbs land on their names, in whatever order and company they came."""
    known = {joint: RELATIVE[:, i] for i, joint in enumerate(H36M17.joints)}
    nowhere = known["nose"]
    given = np.stack([known.get(joint, nowhere) for joint in LAYOUTS[layout].joints], axis=1)
    given += np.array([0, 0, 4.0])
    poses = read(save(given), "arrays", layout=layout, frame="CAMERA", unit="m", handedness="ignore")
    assert poses.layout == H36M17
    hips = (known["l_hip"] + known["r_hip"]) / 2
    pelvis = known["pelvis"] if "pelvis" in LAYOUTS[layout] else hips
    for joint in ("l_wrist", "r_wrist", "l_knee", "r_knee", "r_shoulder"):
        np.testing.assert_allclose(poses.joint(joint), known[joint] - pelvis, atol=1e-5)


def test_joint_count_must_fit_the_layout(save):
    with pytest.raises(InputError, match=r"expected an array of shape \(frames, 26, 3\), got \(60, 17, 3\)"):
        read(save(RELATIVE), "arrays", layout="HALPE26", frame="CAMERA", unit="m")


def test_what_lies_beside_the_joints_is_used(save):
    confidence = np.linspace(0, 1, FRAMES * 17).reshape(FRAMES, 17)
    index, time_s = np.arange(FRAMES) * 2 + 5, np.arange(FRAMES) / 20 + 1.0
    path = save(anything=RELATIVE, confidence=confidence, frame_index=index, time_s=time_s)
    poses = read(path, "arrays", **H36M_METRES)
    np.testing.assert_allclose(poses.joints, RELATIVE, atol=1e-6)
    np.testing.assert_allclose(poses.confidence, confidence, atol=1e-6)
    np.testing.assert_array_equal(poses.frame_index, index)
    np.testing.assert_array_equal(poses.times, time_s)
    assert poses.frames_known


@pytest.mark.parametrize(
    ("beside", "said"),
    [
        (
            {"confidence": np.ones(FRAMES)},
            r"'confidence': expected an array of shape \(60, 17\), got \(60,\)",
        ),
        ({"time_s": np.arange(FRAMES - 1.0)}, r"'time_s': expected an array of shape \(60,\)"),
        ({"frame_index": np.arange(FRAMES) + 0.5}, "whole numbers"),
    ],
)
def test_what_lies_beside_must_fit(save, beside, said):
    with pytest.raises(InputError, match=said):
        read(save(joints=RELATIVE, **beside), "arrays", **H36M_METRES)


def test_several_arrays_need_a_key(save):
    path = save(raw=RELATIVE * 2, smooth=RELATIVE, confidence=np.ones((FRAMES, 17)))
    with pytest.raises(InputError, match="raw, smooth, confidence"):
        read(path, "arrays", **H36M_METRES)
    np.testing.assert_allclose(read(path, "arrays", key="smooth", **H36M_METRES).joints, RELATIVE, atol=1e-6)
    with pytest.raises(InputError, match=r"'rough'.*raw, smooth, confidence"):
        read(path, "arrays", key="rough", **H36M_METRES)
