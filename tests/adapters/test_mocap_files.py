"""BVH, joints beside AMASS's arrays, FreeMoCap and MPI-INF-3DHP (formats.md sections 6 and 7.3)."""

import numpy as np
import pytest

from golden.bodies import feet_in, feet_of, hips_of, limbs_of, standing
from golden.catalogue import recognised
from golden.landmarks import NAMES
from golden.worlds import RIGS, bvh, freemocap, freemocap_csv, freemocap_rtmpose, rig, smpl, y_up
from pcnet3d.adapters import read
from pcnet3d.pipeline import H36M17, Z_UP, InputError, change_frame
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, LIMBS

FRAMES = 40
WORLD = y_up(standing(FRAMES))
BLAZE = freemocap(standing(FRAMES))


def limbs(poses) -> np.ndarray:
    return change_frame(poses, Z_UP.with_(origin="pelvis")).joints[:, H36M17.indices(LIMBS)]


@pytest.mark.parametrize("program", RIGS)
def test_the_head_of_a_rig_faces_as_its_trunk_does(tmp_path, program):
    """Bandai Namco's zero pose is no standing body: all bones lie along x."""
    poses = change_frame(read(rig(program, tmp_path / "x.bvh", WORLD)), Z_UP.with_(origin="pelvis"))
    np.testing.assert_allclose(limbs(poses), limbs_of(standing(FRAMES)), atol=2e-6)
    left = poses.joint("l_hip") - poses.joint("r_hip")
    up = np.array([0.0, 0.0, 1.0])
    ahead = np.cross(left / np.linalg.norm(left, axis=-1, keepdims=True), up)
    made = poses.joint("nose") - poses.joint("head")  # 5 cm ahead of and 13 cm below it
    np.testing.assert_allclose(made, 0.05 * ahead - 0.13 * up, atol=2e-6)


def test_bvh_of_another_unit_and_an_added_t_pose(tmp_path):
    poses = read(bvh(tmp_path / "x.bvh", WORLD, scale=1 / 0.0254, t_pose=True))
    assert len(poses) == FRAMES - 10
    assert poses.times[0] == pytest.approx(10 / 60, rel=1e-3)
    np.testing.assert_allclose(limbs(poses), limbs_of(standing(FRAMES))[10:], atol=2e-6)
    with pytest.raises(InputError, match="give it with unit="):
        read(bvh(tmp_path / "y.bvh", WORLD, scale=7.0))


def test_bvh_with_z_up_is_refused_until_told(tmp_path):
    path = bvh(tmp_path / "x.bvh", standing(FRAMES))
    with pytest.raises(InputError, match="up=z"):
        read(path)
    np.testing.assert_allclose(limbs(read(path, up="z")), limbs_of(standing(FRAMES)), atol=2e-6)


def test_amass_states_its_rate_and_may_be_in_millimetres(tmp_path):
    joints = smpl(standing(FRAMES))
    for rate in ("fps", "mocap_framerate", "mocap_frame_rate"):
        np.savez(tmp_path / "mm.npz", joints=1000 * joints, gender=b"male", **{rate: 120.0})
        poses = read(tmp_path / "mm.npz", unit="mm")
        np.testing.assert_allclose(limbs(poses), limbs_of(standing(FRAMES)), atol=2e-6)
        assert poses.fps == pytest.approx(120)
        assert not poses.frames_known


def test_joints_by_name_keep_their_own_nose(tmp_path):
    order = np.random.default_rng(0).permutation(len(H36M17))
    np.savez(
        tmp_path / "x.npz",
        joints=standing(FRAMES)[:, order],
        fps=30,
        joint_names=np.array(H36M17.joints)[order],
    )
    world = standing(FRAMES)
    np.testing.assert_allclose(read(tmp_path / "x.npz").joints, world - world[:, :1], atol=2e-6)


def test_amass_without_joints_or_rate_is_refused_with_the_reason(tmp_path):
    np.savez(tmp_path / "x_poses.npz", poses=np.zeros((9, 156)), trans=np.zeros((9, 3)), betas=np.zeros(16))
    with pytest.raises(InputError, match="run the body model"):
        read(tmp_path / "x_poses.npz")
    np.savez(tmp_path / "y.npz", joints=standing(FRAMES))
    with pytest.raises(InputError, match="frame rate"):
        read(tmp_path / "y.npz", "amass")
    np.savez(tmp_path / "z.npz", joints=standing(FRAMES)[:, :12], fps=30)
    with pytest.raises(InputError, match="17 joints"):
        read(tmp_path / "z.npz")


def test_freemocap(tmp_path):
    path = tmp_path / "mediapipe_body_3d_xyz.npy"
    gap = BLAZE.copy()
    gap[3, BLAZEPOSE33.index("r_wrist")] = np.nan
    np.save(path, gap)
    poses = read(path)
    assert np.isnan(poses.joint("r_wrist")[3]).all()
    assert poses.time_s is None
    assert not poses.frames_known


def test_freemocap_2_has_feet_in_its_array_and_its_tables(tmp_path):
    world, joints = standing(FRAMES), freemocap_rtmpose(standing(FRAMES))
    np.save(tmp_path / "rtmpose_body_3d_xyz.npy", joints)
    table = freemocap_csv(tmp_path, joints)
    own = [
        line.split(",")
        for line in table.read_text().splitlines()
        if ",3d_xyz," in line and "hand" not in line
    ]
    rows = ["frame,keypoint,x,y,z", *(",".join(cells[:5]) for cells in own)]
    (tmp_path / "rtmpose_body_3d_xyz.csv").write_text("\n".join(rows) + "\n")
    for path in (tmp_path / "rtmpose_body_3d_xyz.npy", table, tmp_path / "rtmpose_body_3d_xyz.csv"):
        assert recognised(path) == ["freemocap"]
        poses = read(path)
        np.testing.assert_allclose(limbs(poses), limbs_of(world), atol=2e-6)
        np.testing.assert_allclose(feet_in(poses), feet_of(world) - hips_of(world), atol=2e-6)
        assert poses.frames_known is (path.suffix == ".csv")


def test_freemocap_table_of_mediapipe_and_damaged_ones(tmp_path):
    lines = ["frame,timestamp,timestamp_by_camera,model,keypoint,x,y,z"]
    for frame, row in enumerate(BLAZE, 5):
        lines += [
            f"{frame},,{{}},mediapipe_body,{name},{x},{y},{z}"
            for name, (x, y, z) in zip(NAMES, row, strict=True)
        ]
    path = tmp_path / "walk_by_frame.csv"
    path.write_text("\n".join(lines) + "\n")
    assert recognised(path) == ["freemocap"]
    np.testing.assert_allclose(limbs(read(path)), limbs_of(standing(FRAMES)), atol=2e-6)
    assert read(path).frame_index[0] == 5
    path.write_text("\n".join([*lines[:9], lines[9].replace("nose", "").replace("5,", "five,", 1)]) + "\n")
    with pytest.raises(InputError, match=r"line 10.*frame's number"):
        read(path)
    path.write_text("\n".join(line for line in lines if "left_knee" not in line) + "\n")
    with pytest.raises(InputError, match="points of a body"):
        read(path)
    path.write_text("frame,keypoint,x,y,z\n0,hand_root,1,2,3\n")
    assert recognised(path) == []


def test_freemocap_flat_or_lying_or_in_metres_is_refused(tmp_path):
    path = tmp_path / "mediapipe_body_3d_xyz.npy"
    np.save(path, BLAZE * [1, 0, 1])
    with pytest.raises(InputError, match="single camera"):
        read(path, "freemocap")
    np.save(path, BLAZE[..., [2, 0, 1]])
    with pytest.raises(InputError, match="ground plane"):
        read(path)
    np.save(path, BLAZE / 1000)
    with pytest.raises(InputError, match="millimetres"):
        read(path, "freemocap")
