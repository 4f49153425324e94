"""TRC as Pose2Sim, OpenSim and Sports2D write it, C3D through ezc3d (formats.md section 6)."""

import numpy as np
import pytest

from golden.bodies import standing
from golden.worlds import POSE2SIM, c3d, trc, y_up
from pcnet3d.adapters import read, read_all
from pcnet3d.pipeline import H36M17, Z_UP, InputError, change_frame
from pcnet3d.pipeline.files.markers import parse_c3d

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
