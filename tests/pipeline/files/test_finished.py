"""A run's folder, read back: the take that run_files returned, in all that the files hold."""

import json
import shutil
from dataclasses import fields, replace

import numpy as np
import pytest

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.files import write_keypoints
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError, RunOptions, load_recipe, nested, read_run, run_files
from pcnet3d.pipeline.core.notices import grave
from pcnet3d.pipeline.files.atomic import plain
from refusals import refused


@pytest.fixture(scope="module", params=["static", "moving"])
def run(request, tmp_path_factory):
    """The take that run_files returned, and its folder."""
    folder, walk = tmp_path_factory.mktemp("finished"), walker()
    camera = side_camera(walk)
    np.save(folder / "X3D.npy", camera_poses(walk, camera).joints)
    write_keypoints(folder / "2d.json", walk, camera, np.arange(len(walk)), 0.5, np.random.default_rng(0))
    told = {"gravity": tuple(-camera.up)} if request.param == "static" else {}
    options = RunOptions(
        poses=folder / "X3D.npy", adapter="videopose3d", keypoints=folder / "2d.json", fps=30, stature=1.75,
        image_size=(640, 360), focal=640, camera=request.param, title="Walk", **told,
    )  # fmt: skip
    recipe = load_recipe().without("record").without("report")
    return run_files(options, folder / "out", recipe), folder / "out"


def same(a: object, b: object, what: str) -> None:
    if isinstance(a, np.ndarray):
        np.testing.assert_array_equal(a, b, err_msg=what)
    else:
        assert a == b, what


def test_the_take_is_the_one_that_was_run(run):
    take, back = run[0], read_run(run[1])
    assert take.keypoints is not None
    for what, lacking in {
        "poses": {"notices", "confidence", "covariance", "path", "feet"},
        "keypoints": {"notices", "history", "covariance"},
        "filtered": {"notices", "confidence", "covariance", "path", "feet"},
    }.items():
        a, b = getattr(take, what), getattr(back, what)
        for field in fields(a):
            if field.name not in lacking:
                wanted = (
                    plain_history(getattr(a, field.name))
                    if field.name == "history"
                    else getattr(a, field.name)
                )
                same(wanted, getattr(b, field.name), f"{what}.{field.name}")
    assert back.kinematics.keys() == take.kinematics.keys()
    for name, values in take.kinematics.items():
        same(values, back.kinematics[name], name)
        assert values.dtype == back.kinematics[name].dtype
    assert words(nested(back.measures)) == words(nested(take.measures))
    assert list(back.inputs) == [plain(entry) for entry in take.inputs]
    assert (back.name, back.session, back.told) == (take.name, take.session, take.told)
    assert back.poses.made_by == take.poses.made_by
    assert (back.cutoff_hz, take.cutoff_hz) == (6.0, 6.0)
    assert back.findings == grave(take.findings)
    assert [each.as_dict() for each in back.said] == [plain(each.as_dict()) for each in take.said]
    for name in ("image_size", "focal_px", "focal_sd_px", "focal_source", "reason"):
        assert (take.camera is None) == (back.camera is None)
        if take.camera:
            same(getattr(take.camera, name), getattr(back.camera, name), name)


def words(group):
    """The same, with words for what is no number, as measures.csv has it."""
    if isinstance(group, dict):
        return {key: words(value) for key, value in group.items()}
    return str(group) if isinstance(group, bool) else plain(group)


def plain_history(steps):
    """As JSON has their options."""
    return tuple(
        replace(step, options=json.loads(json.dumps(plain(step.options), default=str))) for step in steps
    )


def test_so_is_its_rectification(run):
    a, b = run[0].rectified, read_run(run[1]).rectified
    for field in fields(a):
        if field.name not in ("body", "level", "up_own"):
            same(getattr(a, field.name), getattr(b, field.name), field.name)
    for name in ("body", "level"):
        same(getattr(a, name).joints, getattr(b, name).joints, name)
        assert getattr(a, name).frame == getattr(b, name).frame
        assert getattr(b, name).history == plain_history(getattr(a, name).history)
    assert (a.level.root is None) == (b.level.root is None)
    if a.level.root is not None:
        same(a.level.root, b.level.root, "root")
        assert (a.level.measured_root is None) == (b.level.measured_root is None)
        if a.level.path.sd is not None:
            np.testing.assert_allclose(a.level.path.sd, b.level.path.sd, rtol=1e-12)
    assert a.up_own.keys() == b.up_own.keys()
    for name, (up, error_deg) in a.up_own.items():
        np.testing.assert_allclose(b.up_own[name][0], up, atol=1e-9)
        assert b.up_own[name][1] == pytest.approx(error_deg, nan_ok=True)


def test_a_notice_of_another_version_says_what_the_run_said(run, tmp_path):
    other = tmp_path / "other"
    shutil.copytree(run[1], other)
    summary = json.loads((other / "summary.json").read_text())
    said = {"weight": "warning", "about": "", "rows": None, "values": {}}
    texts = {
        "no-such-code": "It was so.",
        "frames-without-joints": "3 rows lack joints.",
        "no-scale": "None.",
    }
    summary["notices"] = [{**said, "code": code, "text": text} for code, text in texts.items()]
    (other / "summary.json").write_text(json.dumps(summary))
    assert {each.code: each.text for each in read_run(other).said} == texts


@pytest.mark.parametrize(
    "damage",
    ["no poses", "nested", "measures", "figure", "errors", "frames", "text", "cut", "rows", "camera"],
)
def test_what_is_no_finished_run_has_one_sentence(run, tmp_path, damage):
    folder = tmp_path / "out"
    shutil.copytree(run[1], folder)
    summary = json.loads((folder / "summary.json").read_text())
    table = (folder / "kinematics.parquet").read_bytes()
    match damage:
        case "no poses":
            (folder / "poses.npz").unlink()
        case "measures":
            summary["measures"] = [1]
        case "figure":  # that the next version has no more
            summary["measures"] = {"walking": {"backward_steps": 3}}
        case "errors":  # fewer than repetitions
            summary["measures"] = {"knee_bends": {"peak_deg": [80.0], "peak_error_deg": []}}
        case "frames":
            summary["poses"]["frame"]["axes"] = ["up", "up", "up"]
        case "camera":
            summary["told"]["camera"] = "flying"
        case "text":
            summary["notices"] = {"a": 1}
        case "cut":
            (folder / "kinematics.parquet").write_bytes(table[:-200])
        case "rows":
            summary["poses"]["seams"] = [10**6]
    text = "[" * 100_000 if damage == "nested" else json.dumps(summary)
    (folder / "summary.json").write_text(text)
    with refused("format-unknown"):
        read_run(folder)


def test_a_folder_that_is_not_there_is_not_said_to_lack_a_field(tmp_path):
    (tmp_path / "file").write_text("x")
    for name in ("nowhere", "file"):
        with refused("cannot-open", name):
            read_run(tmp_path / name)
    with pytest.raises(InputError, match=r"has no summary\.json"):
        read_run(tmp_path)


def test_a_folder_of_several_people_names_one(run, tmp_path):
    shutil.copytree(run[1], tmp_path / "out" / "1")
    with pytest.raises(InputError, match="read one of the runs in it"):
        read_run(tmp_path / "out")
