"""TRC, C3D, BVH, joints beside AMASS's arrays and FreeMoCap, and who made them (formats.md 6)."""

import numpy as np
import pytest

from golden import estimators
from golden.bodies import limbs_of, standing
from golden.catalogue import recognised
from golden.landmarks import NAMES
from golden.worlds import (
    POSE2SIM,
    RIGS,
    bvh,
    c3d,
    freemocap,
    freemocap_csv,
    freemocap_rtmpose,
    rig,
    smpl,
    trc,
    y_up,
)
from pcnet3d.adapters import read, read_all
from pcnet3d.pipeline import H36M17, Z_UP, InputError, change_frame
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, LIMBS
from pcnet3d.pipeline.core.pose import MadeBy
from pcnet3d.pipeline.files.markers import parse_c3d
from pcnet3d.pipeline.plugins.options import option_types
from pcnet3d.pipeline.reading.load import adapters

FRAMES = 40


@pytest.fixture
def markers() -> np.ndarray:
    """(40, 16, 3) z up, metres: POSE2SIM's markers."""
    return standing(FRAMES)[:, H36M17.indices(list(POSE2SIM.values()))]


def agrees(poses, world, leave_out=("spine",)):
    """Whether the joints, in z-up metres, are those of world relative to the pelvis, less those a source lacks."""
    poses = change_frame(poses, Z_UP.with_(origin="pelvis"))
    kept = [H36M17.index(joint) for joint in H36M17.joints if joint not in leave_out]
    np.testing.assert_allclose(poses.joints[:, kept], (world - world[:, :1])[:, kept], atol=2e-6)


def test_pose2sim_begins_anywhere_in_the_video(markers, tmp_path):
    poses = read(trc(tmp_path / "walk_P1_100-139.trc", POSE2SIM, y_up(markers), first=100))
    np.testing.assert_allclose(poses.times, np.arange(100, 140) / 30)
    assert poses.fps == pytest.approx(30)
    assert not poses.frames_known
    assert poses.layout == H36M17  # without feet, which it has not


def test_opensim_in_millimetres_under_our_own_names(tmp_path):
    path = trc(tmp_path / "x.trc", H36M17.joints, 1000 * y_up(standing(FRAMES)), first=1, units="mm")
    poses = read(path)
    assert poses.frame.unit == "m"
    agrees(poses, standing(FRAMES), leave_out=())


@pytest.mark.parametrize(
    "change",
    [
        lambda lines: [*lines[:5], *(line.replace(".", ",") for line in lines[5:])],
        lambda lines: [*lines[:3], *(" ".join(line.split("\t")) for line in lines[3:5]), *lines[5:]],
        lambda lines: [" ".join(line.split("\t")) for line in lines],
        lambda lines: ["\ufeff" + lines[0], *lines[1:]],
    ],
    ids=["decimal commas", "blanks in the header", "blanks", "byte order mark"],
)
def test_trc_in_other_clothes(markers, tmp_path, change):
    path = trc(tmp_path / "x.trc", POSE2SIM, y_up(markers))
    path.write_text("\n".join(change(path.read_text().splitlines())), encoding="utf-8")
    agrees(read(path, "trc"), standing(FRAMES))


def test_a_cell_that_is_no_number_is_refused_with_line_and_column(markers, tmp_path):
    path = trc(tmp_path / "x.trc", POSE2SIM, y_up(markers))
    lines = path.read_text().splitlines()
    lines[8] = lines[8].replace("\t", "\tx", 1)
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match="line 9, column 2: expected a number"):
        read(path)


def test_opencaps_markers_have_no_head(tmp_path):
    """Neck, limbs and feet, and markers of a study beside them."""
    joints = [joint for joint in H36M17.joints if joint not in ("head", "nose", "spine")]
    other = {"thorax": "Neck", "pelvis": "midHip"}
    names = [other.get(j, j[0].upper() + j[2:].capitalize() if j[1] == "_" else j) for j in joints]
    world = y_up(standing(FRAMES))[:, H36M17.indices(joints)]
    studied = [*names, *(f"{name}_study" for name in names)]
    path = trc(tmp_path / "x.trc", studied, np.concatenate([world, world + 0.1], axis=1))
    poses = read(path)
    assert np.isnan(poses.joints[:, H36M17.indices(["nose", "head"])]).all()
    agrees(poses, standing(FRAMES), leave_out=("spine", "nose", "head"))


def test_rows_that_are_left_out_keep_their_distance(markers, tmp_path):
    path = trc(tmp_path / "x.trc", POSE2SIM, y_up(markers))
    lines = path.read_text().splitlines()
    path.write_text("\n".join(lines[:10] + lines[13:]) + "\n")
    poses = read(path)
    assert len(poses) == FRAMES - 3
    assert np.diff(poses.frame_index).max() == 4
    assert poses.fps == pytest.approx(30)


def test_empty_cells_are_gaps(markers, tmp_path):
    markers[5, list(POSE2SIM).index("RWrist")] = np.nan
    path = trc(tmp_path / "x.trc", POSE2SIM, y_up(markers))
    poses = read(path)
    assert np.isnan(poses.joint("r_wrist")[5]).all()
    assert np.isnan(poses.joints).sum() == 3


def test_sports2ds_invented_depth_is_refused(markers, tmp_path):
    flat = y_up(markers)
    flat[..., 2] = 0.01 * np.arange(len(POSE2SIM))
    flat[20:, :, 2] *= -1  # the other side is seen
    with pytest.raises(InputError, match="Sports2D"):
        read(trc(tmp_path / "a.trc", POSE2SIM, flat))


def test_up_is_checked_and_can_be_told(markers, tmp_path):
    path = trc(tmp_path / "x.trc", POSE2SIM, markers)
    with pytest.raises(InputError, match="up=z"):
        read(path)
    agrees(read(path, up="z"), standing(FRAMES))


@pytest.mark.parametrize(("units", "told", "scale"), [("m", None, 1), ("mm", None, 1000), ("m", "mm", 1000)])
def test_without_a_nose_it_is_put_in_front_of_the_neck_and_said(markers, tmp_path, units, told, scale):
    """5 cm in front of the neck's end, and the crown 13 cm above it, whatever unit the file or the user says."""
    kept = [i for i, name in enumerate(POSE2SIM) if name != "Nose"]
    names = [name for name in POSE2SIM if name != "Nose"]
    path = trc(tmp_path / "x.trc", names, scale * y_up(markers)[:, kept], units=units)
    poses = read(path, unit=told)
    assert any("as the shoulders face" in str(step.options) for step in poses.history)
    apart = np.linalg.norm(poses.joint("nose") - poses.joint("head"), axis=-1)
    np.testing.assert_allclose(apart, np.hypot(0.05, 0.13), atol=1e-5)


@pytest.mark.parametrize("prefix", ["S1:", "Ann_"])
def test_a_subjects_name_before_the_points_does_not_matter(markers, tmp_path, prefix):
    path = trc(tmp_path / "x.trc", [prefix + name for name in POSE2SIM], y_up(markers))
    agrees(read(path), standing(FRAMES))
    ours = trc(tmp_path / "y.trc", [prefix + joint for joint in H36M17.joints], y_up(standing(FRAMES)))
    agrees(read(ours), standing(FRAMES), leave_out=())


@pytest.mark.parametrize("write", [trc, c3d])
def test_subjects_are_people(markers, tmp_path, write):
    """Bob lacks an ankle in the second file, which is not to be Ann's."""
    other = standing(FRAMES + 200)[200:]
    points = np.concatenate([markers, other[:, H36M17.indices(list(POSE2SIM.values()))] + [3, 0, 0]], axis=1)
    names = [f"{subject}:{name}" for subject in ("Ann", "Bob") for name in POSE2SIM]
    points = y_up(points) if write is trc else 1000 * points
    ann, bob = read_all(write(tmp_path / f"x.{write.__name__}", names, points))
    assert (ann.person, bob.person) == ("Ann", "Bob")
    agrees(ann, standing(FRAMES))
    agrees(bob, other)

    names[names.index("Bob:LAnkle")] = "Bob:LASI"
    (ann,) = read_all(write(tmp_path / f"y.{write.__name__}", names, points))
    agrees(ann, standing(FRAMES))
    assert [said.values["people"] for said in ann.notices] == ["Bob"]


def test_skin_markers_units_and_damage_have_words(markers, tmp_path):
    path = trc(tmp_path / "x.trc", ["LASI", "RASI"], markers[:, :2])
    with pytest.raises(InputError, match="joint centres"):
        read(path)
    with pytest.raises(InputError, match="yard"):
        read(trc(path, POSE2SIM, y_up(markers), units="yard"))
    trc(path, POSE2SIM, y_up(markers[:0]))
    with pytest.raises(InputError, match=r"x\.trc: expected rows"):
        read(path)
    path.write_text("PathFileType\t4\n")
    with pytest.raises(InputError, match=r"x\.trc: expected a TRC"):
        read(path)


def test_c3d_says_its_unit_and_its_up(markers, tmp_path):
    path = c3d(tmp_path / "x.c3d", POSE2SIM, y_up(markers), unit="m", y_screen="+Y")
    agrees(read(path), standing(FRAMES))


def test_c3d_of_negative_residuals_is_missing(markers, tmp_path):
    markers[7, 2] = np.nan
    path = c3d(tmp_path / "x.c3d", POSE2SIM, 1000 * markers)
    assert np.isnan(read(path).joint("r_knee")[7]).all()


def test_c3d_with_more_frames_than_its_header_counts_is_not_cut(tmp_path):
    full = c3d(tmp_path / "full.c3d", ["a"], np.zeros((65_535, 1, 3)))
    assert parse_c3d(full.read_bytes()).points.shape == (65_535, 1, 3)
    path = c3d(tmp_path / "long.c3d", ["a"], np.zeros((65_600, 1, 3)))
    with pytest.raises(InputError, match=r"long\.c3d: .* counts to frame 65535, .* more data follow"):
        read(path)


def test_the_time_of_other_programs_c3d_begins_with_its_first_frame(markers, tmp_path):
    """Only our own files promise that frame 1 is at 0 s of the take."""
    ezc3d = pytest.importorskip("ezc3d")
    path = c3d(tmp_path / "x.c3d", POSE2SIM, 1000 * markers)
    file = ezc3d.c3d(str(path))
    file["header"]["points"]["first_frame"] = 149
    file.write(str(path))
    assert parse_c3d(path.read_bytes()).first == 150
    np.testing.assert_allclose(read(path).times, np.arange(FRAMES) / 50)


def test_a_c3d_whose_rate_is_a_text(markers, tmp_path):
    path = c3d(tmp_path / "x.c3d", POSE2SIM, 1000 * markers)
    content = path.read_bytes()
    kind = content.index(b"RATE", content.index(b"POINT")) + 6  # behind the distance to the next
    path.write_bytes(content[:kind] + b"\xff" + content[kind + 1 :])
    with pytest.raises(InputError, match=r"x\.c3d: expected a C3D file with points: its POINT:RATE is text"):
        read(path, "c3d")


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


def test_freemocap_2_has_tables_of_the_body_alone(tmp_path):
    table = freemocap_csv(tmp_path, freemocap_rtmpose(standing(FRAMES)))
    lines = [line for line in table.read_text().splitlines() if ",3d_xyz," in line and "hand" not in line]
    rows = ["frame,keypoint,x,y,z", *(",".join(line.split(",")[:5]) for line in lines)]
    path = tmp_path / "rtmpose_body_3d_xyz.csv"
    path.write_text("\n".join(rows) + "\n")
    assert recognised(path) == ["freemocap"]
    np.testing.assert_allclose(limbs(read(path)), limbs_of(standing(FRAMES)), atol=2e-6)


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


def test_every_adapter_of_poses_says_who_made_them_or_lets_the_user_say_it():
    silent = [
        name
        for name, adapter in adapters("poses").items()
        if not hasattr(adapter, "made_by") and "made_by" not in option_types(adapter.read)
    ]
    assert silent == []


def test_a_bvh_does_not_say_it_and_the_user_does(tmp_path):
    path = estimators.gemx_bvh(tmp_path, standing(FRAMES))
    assert read(path).made_by == MadeBy("unknown")
    assert read(path, made_by="estimated").made_by == MadeBy("estimated")
    assert read(path, made_by="measured").made_by.kind == "measured"
    with pytest.raises(InputError, match="made_by"):
        read(path, made_by="guessed")


def test_amass_is_motion_capture_by_its_own_words_alone(tmp_path):
    """WHAM's joints in AMASS's form have a frame rate, and none of motion capture."""
    joints = standing(FRAMES).astype(np.float32)
    own = {"poses": np.zeros((FRAMES, 156)), "trans": np.zeros((FRAMES, 3)), "betas": np.zeros(16)}
    np.savez(tmp_path / "amass.npz", joints=joints, mocap_framerate=30.0, **own)
    np.savez(tmp_path / "wham.npz", joints=joints, fps=30.0)
    assert read(tmp_path / "amass.npz").made_by.kind == "measured"
    assert read(tmp_path / "wham.npz").made_by.kind == "unknown"
    assert read(estimators.soma(tmp_path, joints), fps=30).made_by.kind == "unknown"
