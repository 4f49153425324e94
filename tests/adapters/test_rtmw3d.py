"""RTMW3D's demo JSON: crop pixels and depth bins of 133 joints (formats.md 4)."""

import json

import numpy as np
import pytest

from pcnet3d.adapters import read
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.anthropometry import implied_stature
from pcnet3d.pipeline.layouts import COCO17
from pcnet3d.pipeline.reading import adapters

FRAMES = 60
PIXELS_PER_M = 170.0


@pytest.fixture
def save(turning, tmp_path):
    """save(change) writes results_walk.json of the demo, after change(crop coordinates (T, 133, 3))."""

    def write(change=lambda crop: crop, count: int = 133):
        bodies = turning(FRAMES)
        own = {joint: bodies[:, i] for i, joint in enumerate(H36M17.joints)}
        face = {
            "l_eye": [0.03, -0.03, 0],
            "r_eye": [-0.03, -0.03, 0],
            "l_ear": [0.07, 0, 0.09],
            "r_ear": [-0.07, 0, 0.09],
        }
        coco = [
            own[joint] if joint in own else own["nose"] + np.array(face[joint]) for joint in COCO17.joints
        ]
        whole = np.stack([*coco, *[own["nose"]] * (count - len(coco))], axis=1)
        crop = np.empty_like(whole)
        crop[..., :2] = whole[..., :2] * PIXELS_PER_M + [144, 190]
        crop[..., 2] = (whole[..., 2] / 2.1744869 + 1) * 144
        written = -change(crop)[..., [0, 2, 1]]
        written[..., 2] -= written[..., 2].min(axis=1, keepdims=True)
        frames = [
            {
                "frame_id": i + 1,
                "instances": [{"keypoints": row.tolist(), "keypoint_scores": [1.2 + 0.1 * (i % 3)] * count}],
            }
            for i, row in enumerate(written)
        ]
        path = tmp_path / "results_walk.json"
        path.write_text(
            json.dumps({"meta_info": {"dataset_name": "coco_wholebody"}, "instance_info": frames})
        )
        return path

    return write


def test_golden(save, turning):
    stature = implied_stature(turning(FRAMES))
    path = save()
    assert [name for name, each in adapters().items() if each.sniff(path)] == ["rtmw3d"]
    poses = read(path, fps=30, stature_m=stature)
    limbs = [joint for joint in H36M17.joints if joint.endswith(("hip", "knee", "ankle", "elbow", "wrist"))]
    expected = turning(FRAMES)
    hips = expected[:, H36M17.indices(["l_hip", "r_hip"])].mean(axis=1)  # COCO has no pelvis
    for joint in limbs:
        np.testing.assert_allclose(poses.joint(joint), expected[:, H36M17.index(joint)] - hips, atol=2e-3)
    assert (poses.frame.name, poses.frame.unit) == ("CAMERA", "m")
    assert poses.frame_index[0] == 0
    assert np.nanmax(poses.confidence) == 1


def test_what_is_assumed_is_said(save):
    warnings = [step.options["warning"] for step in read(save()).history if "warning" in step.options]
    assert any("stature of 1.7 m was assumed" in text for text in warnings)
    assert any("no vertical movement" in text for text in warnings)


def test_stature_sets_the_plane_and_not_the_depth(save):
    path = save()
    small, tall = (read(path, stature_m=stature) for stature in (1.5, 1.9))
    assert implied_stature(tall.joints) == pytest.approx(1.9, abs=1e-3)
    np.testing.assert_allclose(small.joints[..., 2], tall.joints[..., 2], atol=1e-6)
    with pytest.raises(InputError, match="stature_m"):
        read(path, stature_m=17)


def test_wrong_joints_name_the_other_adapter(save):
    with pytest.raises(InputError, match="adapter mmpose3d reads 17"):
        read(save(count=17), "rtmw3d")


def test_depth_without_a_body_is_refused(save):
    with pytest.raises(InputError, match="deeper than tall"):
        read(save(lambda crop: crop * [1, 1, 100]), "rtmw3d")


def test_mirrored_is_refused(save):
    with pytest.raises(InputError, match="mirrored"):
        read(save(lambda crop: crop * [-1, 1, 1]))
