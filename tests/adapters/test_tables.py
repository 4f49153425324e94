"""Tables of joints by name or number, in 2D and 3D: DeepLabCut, anipose, SAM3DBody-cpp and whoever's."""

import numpy as np
import pytest

from golden import worlds
from golden.bodies import Person
from golden.catalogue import recognised
from golden.estimators import sam3d_csv
from pcnet3d.adapters import read, table2d
from pcnet3d.adapters.kit.names import joint_named
from pcnet3d.pipeline import H36M17, InputError
from refusals import refused

FRAMES = 40
WORLD = Person().standing(FRAMES)


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
    joints = WORLD if up == "z" else worlds.y_up(WORLD)
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
    lying = WORLD[..., [2, 1, 0]] * [1, -1, 1]
    with refused("wrong-axes"):
        read(_write(tmp_path / "a.csv", H36M17.joints, lying))
    with refused("needs-input"):
        read(_write(tmp_path / "a.csv", H36M17.joints, 7 * WORLD))
    assert read(tmp_path / "a.csv", unit="mm", up="z").frame.family == "world"


def test_a_body_without_head_or_nose(tmp_path):
    names = [joint for joint in H36M17.joints if joint not in ("nose", "head", "spine")]
    poses = read(_write(tmp_path / "a.csv", names, WORLD[:, H36M17.indices(names)]))
    assert np.isnan(poses.joint("head")).all()
    assert np.isnan(poses.joint("nose")).all()
    assert np.isfinite(poses.joint("spine")).all()


def test_a_table_without_limbs_is_refused_with_those_that_lack(tmp_path):
    names = [joint for joint in H36M17.joints if joint != "l_wrist"]
    path = _write(tmp_path / "a.csv", names, WORLD[:, H36M17.indices(names)])
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
