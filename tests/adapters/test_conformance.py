"""Every adapter keeps its promises on its golden files, which come back as the people who were written into them, and
docs/adapters.md says what they show."""

from functools import cache

import numpy as np
import pytest

from golden import table
from golden.bodies import Person, feet_in, feet_of, hips_of, limbs_of, standing, turning
from golden.catalogue import CATALOGUE, Golden, recognised
from golden.detections import between_shoulders
from golden.lifters import x3d
from pcnet3d.adapters import ddhpose, motionbert, read, read_all, videopose3d
from pcnet3d.pipeline import H36M17, Z_UP, PoseSequence, change_frame
from pcnet3d.pipeline.core.layouts import FEET, OPENPOSE18
from pcnet3d.pipeline.plugins import registry
from refusals import refused


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """shown(golden): its row of the table, once its adapter has kept all promises; each file is read once."""

    @cache
    def of(golden: int) -> list[str]:
        return table.row(CATALOGUE[golden], tmp_path_factory.mktemp("golden"))

    return lambda golden: of(CATALOGUE.index(golden))


def called(golden: Golden) -> str:
    return f"{golden.adapter}: {golden.form}"


OTHERWISE = (  # written from other people, and tested by themselves
    ("json2d", "the same of BODY_25B"), ("arrays", "`.npy` of (frames, 17, 3), of no known lifter"),
    ("mmpose3d", "RTMW3D's `results_<video>.json`"),
)  # fmt: skip
OF_PEOPLE = [
    golden
    for golden in CATALOGUE
    if golden.adapter not in ("video", "imu_csv") and (golden.adapter, golden.form) not in OTHERWISE
]
# Recognised by these too, which come second: a file of AlphaPose or OpenPose holds 2D and 3D, a vis.py's folder both.
BESIDE = {"json2d", "vis2d"}
BIG, SMALL = (FEET.indices([f"{side}_{toe}_toe" for side in "rl"]) for toe in ("big", "small"))


@pytest.fixture
def people(tmp_path):
    """people(golden): everybody who is read from it."""

    def of(golden: Golden) -> tuple[PoseSequence, ...]:
        path = golden.write(Person(), tmp_path)
        if not golden.by_name:
            assert set(recognised(path)) - BESIDE <= {golden.adapter}
        return read_all(path, golden.adapter if golden.by_name else "auto", **golden.options)

    return of


def shows(poses: PoseSequence, begin: int) -> bool:
    """Whether 3D poses are the person of the golden files, who is the second one or the same who stands elsewhere, with
    the heels and toes that the layout has. begin: the file's first frame."""
    made, frames = turning, poses.frame_index
    if poses.frame.family == "world":
        made, poses = standing, change_frame(poses, Z_UP.with_(origin="pelvis", unit=poses.frame.unit))
    feet, true_feet = feet_in(poses) - hips_of(poses.joints), feet_of(made(300)) - hips_of(made(300))
    if poses.layout != H36M17 and np.isnan(feet[:, SMALL]).all():  # the toe is MediaPipe's foot index
        true_feet[:, BIG] = true_feet[:, [*BIG, *SMALL]].reshape(-1, 2, 2, 3).mean(axis=1)
    has = np.isfinite(feet).any(axis=(0, 2))
    assert has.any() == (poses.layout != H36M17)
    body = np.concatenate([limbs_of(poses.joints), feet[:, has]], axis=1)
    truth = np.concatenate([limbs_of(made(300)), true_feet[:, has]], axis=1)
    there = np.isfinite(body).all(axis=(1, 2))
    assert there.mean() > 0.9
    return any(
        np.allclose(body[there], truth[rows][there], atol=1e-4)
        for rows in (frames - begin, frames - frames[0] + 200)
    )


@pytest.mark.parametrize("golden", OF_PEOPLE, ids=called)
def test_people_come_back_as_they_were_written(people, golden):
    everybody = people(golden)
    for number, poses in enumerate(everybody):
        if poses.frame.dims == 3:
            assert shows(poses, everybody[0].frame_index[0])
        else:
            scene = Person().two_in_images(poses.layout)[str(number)]
            frames, points = between_shoulders(scene) if poses.layout == OPENPOSE18 else scene
            np.testing.assert_allclose(poses.joints, points[..., :2], atol=0.02)
            np.testing.assert_array_equal(poses.frame_index, frames)
            scored = np.isfinite(poses.confidence)
            np.testing.assert_allclose(poses.confidence[scored], points[..., 2][scored], atol=1e-5)


@pytest.mark.parametrize("golden", CATALOGUE, ids=called)
def test_promises(shown, golden):
    assert shown(golden)[0] == golden.adapter


def test_every_registered_adapter_has_a_golden_file():
    ours = {
        name for name, point in registry.registered("adapters").items() if point.value.startswith("pcnet3d.")
    }
    assert {golden.adapter for golden in CATALOGUE} == ours


def test_the_table_in_the_documents_is_what_the_files_show(shown):
    rows = [shown(golden) for golden in CATALOGUE]
    _, written, _ = table.parts(table.DOCUMENT.read_text(encoding="utf-8"))
    assert written == table.table(rows), "rewrite it with PYTHONPATH=tests python -m golden.table"


def test_every_adapter_with_scores_has_their_meaning_in_the_documents(shown):
    scored = {golden.adapter for golden in CATALOGUE if "scores" in shown(golden)[3]}
    _, _, after = table.parts(table.DOCUMENT.read_text(encoding="utf-8"))
    rows = after[after.index("## Scores") :].splitlines()
    said = {name for row in rows if row.startswith("|") for name in row.split("|")[1].strip().split(", ")}
    assert scored <= said


@pytest.mark.parametrize("adapter", [motionbert, videopose3d, ddhpose], ids=lambda adapter: adapter.name)
def test_arrays_of_lifters(tmp_path, adapter):
    """Other joints, dimensions or units are refused; frames that failed are gaps."""
    path, joints = tmp_path / "x.npy", turning(600)
    joints = x3d(joints) if adapter is motionbert else joints.astype(np.float32)
    wrong = [(np.ones(shape, np.float32), "wrong-content") for shape in ((300, 16, 3), (300, 17, 2), (17, 3))]
    for array, code in wrong if adapter is motionbert else [*wrong, (1000 * joints, "wrong-axes")]:
        np.save(path, array)
        assert not adapter.sniff(path)
        with refused(code):
            read(path, adapter.name)
    for failed in (np.nan, 0.0):
        joints[100:110] = failed
        np.save(path, joints)
        gone = np.isnan(read(path, adapter.name).joints)
        assert gone[100:110].all()
        assert gone.sum() == 10 * 17 * 3
