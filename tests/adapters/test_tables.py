"""Tables by name or number, in 2D and 3D, of DeepLabCut, anipose, SAM3DBody-cpp and whoever's; and which frame a row is
and when, by whatever name and unit a table or JSON says it (kit/clock.py)."""

import numpy as np
import pytest

from golden import landmarks, worlds
from golden.bodies import Person, turning
from golden.catalogue import recognised
from golden.estimators import sam3d_csv
from pcnet3d.adapters import read, read_all, table2d
from pcnet3d.adapters.kit.clock import kind_of, plain
from pcnet3d.adapters.kit.names import joint_named
from pcnet3d.pipeline import H36M17, InputError
from refusals import refused

FRAMES = 60
WORLD = landmarks.landmarks(turning(FRAMES))[..., :3]
LOST = [*range(20, 35)]
KEPT = [i for i in range(FRAMES) if i not in LOST]
AXES = [f"{axis}{i}" for i in range(33) for axis in "xyz"]


@pytest.fixture
def table(tmp_path):
    """table(columns, frames) writes a CSV: columns of cells by name before the landmarks."""

    def write(columns, frames=KEPT):
        rows = [[*(cell(i) for cell in columns.values()), *WORLD[i % FRAMES].ravel()] for i in frames]
        return landmarks.write_csv(tmp_path / "a.csv", [*columns, *AXES], rows)

    return write


FRAME_COLUMNS = {
    **{
        name: (lambda i: i)
        for name in ("frame", "frameIndex", "Frame number", "frame.idx", "FRAME_ID", "fnum", "f")
    },
    "image": lambda i: f"frame_{i:04d}.jpg",
    "file_name": lambda i: f"walk/{i}.png",
    "imageName": lambda i: f"clip-{i:06d}.jpeg",
    "": lambda i: i,
    "Unnamed: 0": lambda i: i,
}
TIME_COLUMNS = {
    "time_s": lambda i: i / 30,
    "Time (s)": lambda i: i / 30,
    "time": lambda i: round(i / 30, 3),
    "timestamp": lambda i: round(1000 * i / 30),
    "timestampMs": lambda i: 1000 * i / 30,
    "t": lambda i: round(1e6 * i / 30),
    "timestamp_us": lambda i: round(1e6 * i / 30),
    "Timestamp": lambda i: 1_700_000_000 + i / 30,
    "time_stamp": lambda i: f"2026-03-01T10:00:{i / 30:09.6f}",
}


@pytest.mark.parametrize("name", FRAME_COLUMNS)
def test_frames_by_any_name_leave_a_gap(table, name):
    poses = read(table({name: FRAME_COLUMNS[name]}))
    assert poses.frame_index.tolist() == KEPT
    assert poses.frames_known
    assert not poses.notices


@pytest.mark.parametrize("name", TIME_COLUMNS)
def test_times_in_any_unit_leave_a_gap(table, name):
    poses = read(table({name: TIME_COLUMNS[name]}))
    assert poses.frame_index.tolist() == KEPT
    assert not poses.frames_known
    np.testing.assert_allclose(poses.times, np.array(KEPT) / 30, atol=2e-3)


def test_a_table_without_a_line_of_names_is_refused(tmp_path):
    rows = [[i, *WORLD[i].ravel()] for i in KEPT]
    with refused("format-unknown", "table3d", "names no columns"):
        read(landmarks.write_csv(tmp_path / "a.csv", None, rows))


@pytest.mark.parametrize("name", ["", "Unnamed: 0", "index", "row"])
def test_a_column_that_only_counts_the_rows_says_nothing(table, name):
    poses = read(table({name: KEPT.index}))
    assert poses.frame_index.tolist() == list(range(len(KEPT)))
    assert not poses.frames_known
    assert not poses.notices


@pytest.mark.parametrize(
    ("name", "cell"),
    [
        ("tick", lambda i: 7 * i),
        ("my_frame_counter", lambda i: i),
        ("time", lambda i: 7 * i),
        ("Unnamed: 0", lambda i: round(1000 * i / 30)),
        ("clock", lambda i: f"00:00:{i / 30:06.3f}"),
    ],
)
def test_what_looks_like_a_clock_and_is_not_used_is_named(table, name, cell):
    poses = read(table({name: cell}))
    assert not poses.frames_known
    (said,) = poses.notices
    assert (said.code, said.values["column"]) == ("clock-not-used", name)


def test_words_beside_the_numbers_do_no_harm(table):
    assert not read(table({"class": lambda i: "walk", "frame": lambda i: i})).notices


@pytest.mark.parametrize("cell", ["x", "", "1.5", "-1"])
def test_a_frame_that_is_no_number_is_refused_with_its_line(table, cell):
    with pytest.raises(InputError, match="line 7"):
        read(table({"frame": lambda i: cell if i == 5 else i}))


def test_times_that_do_not_go_on_are_refused(table):
    with refused("times-broken"):
        read(table({"frame": lambda i: i, "time_s": lambda i: abs(i - 10) / 30}))


@pytest.mark.parametrize("name", ["file_name", "video", "clip", "image"])
def test_two_recordings_are_refused(table, name):
    cells = {name: lambda i: "ab"[i >= FRAMES] + ".mp4", "frame_number": lambda i: i % FRAMES}
    with refused("files-apart", "a.mp4, b.mp4"):
        read(table(cells, range(2 * FRAMES)))


def test_one_recordings_name_is_no_matter(table):
    path = table({"video": lambda i: "walk1.mp4", "frame": lambda i: i})
    assert read(path).frame_index.tolist() == KEPT


@pytest.mark.parametrize(
    "entry",
    [
        lambda i: {"frameNumber": i, "timestampMs": 1000 * i / 30},
        lambda i: {"frame_index": i},
        lambda i: {"image": f"{i}.jpg", "time": i / 30},
    ],
)
@pytest.mark.parametrize("key", ["poseWorldLandmarks", "pose_world_landmarks", "worldLandmarks"])
def test_json_says_it_under_the_same_names(tmp_path, entry, key):
    frames = [{**entry(i), key: [landmarks.points(np.c_[WORLD[i], np.ones(33)])]} for i in KEPT]
    poses = read(landmarks.dump(tmp_path, frames))
    assert poses.frame_index.tolist() == KEPT
    assert poses.frames_known


@pytest.mark.parametrize("rate", [{"fps": 30.0}, {"metadata": {"frameRate": 30}}])
def test_a_rate_beside_the_frames_is_theirs(tmp_path, rate):
    """Every second frame, at half the rate, and none of them missing."""
    frames = [
        {"frame_index": i, "landmarks": landmarks.points(np.c_[WORLD[i], np.ones(33)])}
        for i in range(0, 60, 2)
    ]
    for content in ({"frames": frames, **rate}, {**rate, "frames": frames}):
        poses = read(landmarks.dump(tmp_path, content))
        np.testing.assert_allclose(poses.times, np.arange(0, 60, 2) / 30)


@pytest.mark.parametrize("missing", ["", "NaN", "NA", "None", "null", "-1"])
def test_words_for_missing(table, tmp_path, missing):
    path = table({"frame": lambda i: i}, range(20))
    lines = path.read_text().splitlines()
    lines[6] = ",".join(["5", *[missing] * 99])
    path.write_text("\n".join(lines))
    assert read(path).frame_index.tolist() == [i for i in range(20) if i != 5]


def test_a_cell_that_is_no_number_is_refused_with_line_and_column(table):
    path = table({"frame": lambda i: i})
    lines = path.read_text().splitlines()
    lines[4] = lines[4].replace(",", ",much", 1)
    path.write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"line 5, column 2 \('x0'\): expected a number, got 'much"):
        read(path)


def test_people_by_columns_of_any_name(tmp_path):
    for name in ("track_id", "personId", "person", "id"):
        header = ["frame", name, *AXES]
        rows = [[i, who, *(WORLD[i] + 0).ravel()] for i in range(20) for who in ("a", "b")]
        people = read_all(landmarks.write_csv(tmp_path / "a.csv", header, rows))
        assert [poses.person for poses in people] == ["a", "b"]


def test_a_comma_in_a_name_stays_where_numbers_have_decimal_commas(tmp_path):
    rows = [[i, "Ann, Bo", *(f"{number:.4f}".replace(".", ",") for number in WORLD[i].ravel())] for i in KEPT]
    lines = [";".join(map(str, row)) for row in [["frame", "person", *AXES], *rows]]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    (poses,) = read_all(tmp_path / "a.csv")
    assert poses.person == "Ann, Bo"
    assert poses.frame_index.tolist() == KEPT


def test_a_number_of_each_row_is_nobodys_name(tmp_path):
    rows = [[100 + i, i, *WORLD[i].ravel()] for i in KEPT]
    (poses,) = read_all(landmarks.write_csv(tmp_path / "a.csv", ["id", "frame", *AXES], rows))
    assert poses.frame_index.tolist() == KEPT


def test_plain_names():
    for name in ("frameNumber", "Frame number", "frame.number", "FRAME_NUMBER", " frame number "):
        assert plain(name) == "frame_number"
    assert plain("nose_3DX") == "nose_3dx"
    assert [kind_of(name) for name in ("frame", "img", "ms", "clip", "track_id", "fps", "", "my_frame", "knee")] == [
        "frame", "image", "time", "recording", "person", "rate", "unnamed", "like", ""
    ]  # fmt: skip


STANDS = Person().standing(FRAMES)


def _write(path, names, points, separator=","):
    header = separator.join(f"{name}_{axis}" for name in names for axis in "xyz"[: points.shape[-1]])
    rows = [separator.join(map(str, row.ravel())) for row in points]
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


@pytest.mark.parametrize(
    ("label", "joint"),
    [
        ("left_knee", "l_knee"), ("LKnee", "l_knee"), ("knee_r", "r_knee"), ("RightHip", "r_hip"), ("rhip", "r_hip"),
        ("RBigToe", "r_big_toe"), ("left_big_toe_tip", "l_big_toe"), ("mid_hip", "pelvis"), ("Hip", "pelvis"),
        ("Top_Head", "head_top"), ("ankle1", "r_ankle"), ("wrist2", "l_wrist"), ("l_foot_index", "l_foot_index"),
        ("r_knee_study", ""), ("left", ""), ("", ""), ("center_of_mass", ""),
    ],
)  # fmt: skip
def test_names(label, joint):
    assert joint_named(label) == joint


@pytest.mark.parametrize(("unit", "scale"), [("m", 1), ("cm", 100), ("mm", 1000)])
@pytest.mark.parametrize("up", ["z", "y"])
def test_3d_tables_show_their_axes_and_unit(tmp_path, unit, scale, up):
    joints = STANDS if up == "z" else worlds.y_up(STANDS)
    poses = read(_write(tmp_path / "a.csv", H36M17.joints, scale * joints))
    assert (poses.frame.family, poses.frame.unit) == ("world", "m")
    np.testing.assert_allclose(
        poses.joint("l_wrist"), (joints - joints[:, :1])[:, H36M17.index("l_wrist")], atol=1e-5
    )


def test_3d_tables_of_a_camera(tmp_path):
    joints = Person().turning(FRAMES) + np.array([0.2, 0.1, 3.0])
    poses = read(_write(tmp_path / "a.csv", H36M17.joints, joints))
    assert poses.frame.name == "CAMERA"
    np.testing.assert_allclose(poses.joints, joints - joints[:, :1], atol=1e-5)


def test_3d_tables_that_do_not_show_it_need_to_be_told(tmp_path):
    lying = STANDS[..., [2, 1, 0]] * [1, -1, 1]
    with refused("wrong-axes"):
        read(_write(tmp_path / "a.csv", H36M17.joints, lying))
    with refused("needs-input"):
        read(_write(tmp_path / "a.csv", H36M17.joints, 7 * STANDS))
    assert read(tmp_path / "a.csv", unit="mm", up="z").frame.family == "world"


def test_a_body_without_head_or_nose(tmp_path):
    names = [joint for joint in H36M17.joints if joint not in ("nose", "head", "spine")]
    poses = read(_write(tmp_path / "a.csv", names, STANDS[:, H36M17.indices(names)]))
    assert np.isnan(poses.joint("head")).all()
    assert np.isnan(poses.joint("nose")).all()
    assert np.isfinite(poses.joint("spine")).all()


def test_a_table_without_limbs_is_refused_with_those_that_lack(tmp_path):
    names = [joint for joint in H36M17.joints if joint != "l_wrist"]
    path = _write(tmp_path / "a.csv", names, STANDS[:, H36M17.indices(names)])
    assert recognised(path) == []
    with pytest.raises(InputError, match="l_wrist lack"):
        read(path, "table3d")
    with refused("format-unknown", "table3d", "it has no l_wrist"):
        read(path)


def test_sam3dbody_cpp_knows_no_frames_and_has_0_for_none(tmp_path):
    path = sam3d_csv(tmp_path, Person().turning(FRAMES))
    lines = path.read_text().splitlines()
    lines[6] = ",".join(["0"] * 210)
    path.write_text("\n".join(lines) + "\n")
    poses = read(path)
    assert poses.history[0].options["adapter"] == "mhr70"
    assert len(poses) == FRAMES - 1
    assert not poses.frames_known


def test_deeplabcut_of_several_individuals(tmp_path):
    names = [f"{side}_{part}" for side in ("left", "right") for part in
             ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")]  # fmt: skip
    columns = [
        (who, name, axis) for who in ("ann", "bob") for name in names for axis in ("x", "y", "likelihood")
    ]
    rng = np.random.default_rng(0)
    lines = [",".join(["scorer", *["DLC"] * len(columns)])]
    lines += [
        ",".join([what, *[c[i] for c in columns]])
        for i, what in enumerate(("individuals", "bodyparts", "coords"))
    ]
    lines += [",".join(map(str, [i, *rng.uniform(0.1, 0.9, len(columns)) * 300])) for i in range(FRAMES)]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    people = table2d.read(tmp_path / "a.csv")
    assert [poses.person for poses in people] == ["ann", "bob"]
    assert all(len(poses) == FRAMES for poses in people)


@pytest.mark.parametrize("names", [[f"kp{i}" for i in range(17)], [f"{i}" for i in range(17)]])
def test_numbered_columns_of_2d(tmp_path, names):
    points = np.random.default_rng(0).uniform(50, 400, (FRAMES, 17, 2))
    path = _write(tmp_path / "a.csv", names, points)
    assert recognised(path) == ["table2d"]
    (poses,) = table2d.read(path)
    assert poses.layout.name == "COCO17"
    np.testing.assert_allclose(poses.joints, points, atol=1e-3)


def test_a_row_a_joint_in_2d(tmp_path):
    points = np.random.default_rng(0).uniform(50, 400, (FRAMES, 12, 2))
    names = [f"{s}{part}" for s in "LR" for part in ("Hip", "Knee", "Ankle", "Shoulder", "Elbow", "Wrist")]
    lines = ["frame;bodypart;x;y;score"]
    lines += [
        f"{i};{name};{x:.2f};{y:.2f};0.8".replace(".", ",") for i, row in enumerate(points)
        for name, (x, y) in zip(names, row, strict=True)
    ]  # fmt: skip
    (tmp_path / "a.csv").write_text("\n".join(lines))
    assert recognised(tmp_path / "a.csv") == ["table2d"]
    poses = read(tmp_path / "a.csv")
    np.testing.assert_allclose(poses.joint("r_wrist"), points[:, names.index("RWrist")], atol=0.01)
