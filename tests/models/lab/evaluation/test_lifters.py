"""Lifters compared by person: weights and intervals."""

import json

import numpy as np
import pytest

from golden.virtual import walked
from pcnet3d.models.lab.evaluation import evaluate as reports
from pcnet3d.models.lab.evaluation import lifter_takes, lifters
from pcnet3d.models.lab.evaluation.lifter_takes import EXACT, FIGURES, PUBLISHED, Material, judge
from pcnet3d.models.lab.evaluation.lifters import difference, rows_of
from pcnet3d.models.lab.evaluation.people import by_person, interval, pooled
from pcnet3d.pipeline import CAMERA, H36M17, InputError
from pcnet3d.pipeline.core.layouts import remap
from pcnet3d.pipeline.core.lifted import Lifted
from pcnet3d.pipeline.core.rotations import unit

_KEY = (PUBLISHED, "upright", "wild", "a@1")


@pytest.fixture(scope="module")
def clips():
    return [walked("07_01", seconds=2), walked("07_02", seconds=4 / 3), walked("43_01", seconds=5 / 3)]


class Wrong:
    """A lifter of another project: the truth of the only take there is, off by some mm at the left wrist along x."""

    method, unit, takes = "wrong@012345678901", "arbitrary", ()

    def __init__(self, truths, off_mm=17.0):
        self.truths, self.off_mm, self.asked = truths, off_mm, []

    def lift(self, asked):
        self.asked.append(asked.focal_px)
        joints = self.truths[len(asked.keypoints)].copy()
        joints[:, H36M17.index("l_wrist"), 0] += self.off_mm / 1000
        keypoints = remap(asked.keypoints, H36M17)
        poses = keypoints.with_(joints=joints, frame=CAMERA.with_(origin="pelvis", unit="arbitrary"))
        return Lifted(poses, self.method, "toy", asked.focal_px, asked.focal_known)


def vector(value):
    return np.full(len(FIGURES), float(value))


def test_every_person_has_one_weight():
    many, few = [vector(1)] * 9 + [vector(11)], [vector(10)]
    here = by_person([*(("one", take) for take in many), *(("other", take) for take in few)])
    people = {"here": here, "there": by_person([("third", vector(60))])}
    here, there, everybody = rows_of(_KEY, people)
    assert (here["part"], here["people"], here["MPJPE"]) == ("here", 2, 6.0)  # 2 and 10
    assert (there["people"], there["MPJPE"]) == (1, 60.0)
    assert (everybody["part"], everybody["people"], everybody["velocity"]) == ("all", 3, 24.0)


def test_what_a_take_lacks_is_left_out():
    gap = vector(4)
    gap[1] = np.nan
    (row,) = rows_of(_KEY, {"here": by_person([("one", gap), ("one", vector(2))])})
    assert (row["MPJPE"], row["PA-MPJPE"]) == (3.0, 2.0)


def test_a_network_against_itself_differs_by_nothing():
    people = {"here": {str(i): vector(i) for i in range(9)}}
    found = difference(people, people)
    assert found.pop("people") == 9
    assert all(of == {"mean": 0.0, "low": 0.0, "high": 0.0} for of in found.values())


def test_the_interval_is_that_of_people_drawn_anew():
    constant = {"here": {str(i): vector(i - 3) for i in range(9)}}
    people = {"here": {str(i): vector(i) for i in range(9)}}
    assert difference(constant, people)["MPJPE"] == pytest.approx({"mean": -3, "low": -3, "high": -3})
    rng = np.random.default_rng(1)
    values = rng.normal(size=400)
    low, high = interval(values)
    sd = values.std() / 20  # of the mean; the bootstrap's quantiles are the normal ones for so many
    assert (low, high) == pytest.approx((values.mean() - 1.645 * sd, values.mean() + 1.645 * sd), abs=0.01)
    assert (low, high) == interval(values)  # the same draws each time
    # Of two people the mean is one of three values: a, (a + b) / 2 and b, the outer ones a quarter of the time each.
    assert interval(np.array([0.0, 1.0])) == (0.0, 1.0)


def test_one_person_has_no_interval_and_only_shared_people_count():
    one = {"here": {"a": vector(5), "b": vector(7)}}
    other = {"here": {"a": vector(3)}}
    found = difference(one, other)
    assert (found["people"], found["MPJPE"]["mean"]) == (1, 2.0)
    assert np.isnan(found["MPJPE"]["low"])


def test_a_known_error_is_measured(clips):
    (take,) = Material("CMU val", "wild", 0, clips[:1]).takes()
    wrist, ray = H36M17.index("l_wrist"), take.seen.R_camera_from_ray[..., 2]
    off = np.zeros((60, 17, 3))
    off[:, wrist] = 0.017 * unit(
        np.cross(ray, take.seen.truth[:, wrist])
    )  # square to the wrist: no other scale
    frame = CAMERA.with_(origin="pelvis", unit="arbitrary")
    poses = take.inputs[PUBLISHED][0].with_(joints=2.5 * (take.seen.truth + off), frame=frame)
    judged = judge(take.seen, poses)
    found = dict(zip(FIGURES, judged["upright"], strict=True))
    assert judged.keys() == {"upright"}
    assert found["MPJPE"] == pytest.approx(1.0, abs=0.05)  # 17 mm at one of 17 joints
    assert found["across the ray"] == pytest.approx(1.0, abs=0.05)
    assert found["along the ray"] < 0.02
    assert found["knee_flexion"] < 0.1 < found["elbow_flexion"]
    assert found["lifted"] == 100
    assert judge(take.seen, poses.with_(joints=np.full((60, 17, 3), np.nan)))["upright"][-1] == 0


def test_the_conditions_share_their_cameras(clips):
    (take,) = Material("CMU val", "typical", 2, clips[:1]).takes()
    (noisy, unknown), (exact, focal) = take.inputs[PUBLISHED], take.inputs[EXACT]
    assert unknown is None
    size = np.ptp(np.nan_to_num(exact.joints), axis=(0, 1)).max()
    assert 0 < np.nanmedian(np.abs(noisy.joints - exact.joints)) < 0.05 * size
    rays = (exact.joints - np.array(take.seen.image_size) / 2) / focal
    shoulder, ankle = H36M17.indices(("l_shoulder", "l_ankle"))
    across = take.seen.truth[:, shoulder] - take.seen.truth[:, ankle]
    assert np.sign(across[:, 1]).tolist() == np.sign(rays[:, shoulder] - rays[:, ankle])[:, 1].tolist()


@pytest.fixture
def wrong(clips, monkeypatch):
    """Of two people as all the validation there is, before one kind of camera."""
    material = Material("CMU val", "wild", 0, clips)
    monkeypatch.setattr(lifters, "materials", lambda seeds, only: [material])
    truths = {len(take.seen.truth): take.seen.truth for take in material.takes()}
    wrong = Wrong(truths)
    monkeypatch.setattr(lifters, "opened", lambda names: {wrong.method: wrong})
    return wrong


def test_any_lifter_is_judged_and_the_page_says_how_few_people(wrong, tmp_path, capsys):
    reports.lifters(networks=["wrong"], output=tmp_path / "out")
    assert len(wrong.asked) == 9  # three takes, three conditions
    assert sorted(focal is None for focal in wrong.asked) == [False] * 6 + [True] * 3
    page = (tmp_path / "out" / "lifters.md").read_text()
    assert page in capsys.readouterr().out
    assert "people: 2 (CMU val)." in page
    results = json.loads((tmp_path / "out" / "lifters.json").read_text())
    assert results["networks"] == [Wrong.method]
    assert results["people"] == {"CMU val": ["07", "43"]}
    rows = {(row["condition"], row["views"]): row for row in results["rows"]}
    assert rows[PUBLISHED, "wild"]["MPJPE"] == pytest.approx(1.2, abs=0.3)  # at one of 17 joints
    assert rows[PUBLISHED, "wild and typical"]["people"] == 2


@pytest.mark.parametrize("content", [b"nothing", None])
def test_a_file_that_is_no_lifter_is_refused_before_the_work(tmp_path, monkeypatch, content):
    monkeypatch.setattr(lifters, "materials", lambda *_: pytest.fail("it works"))
    if content is not None:
        (tmp_path / "a.onnx").write_bytes(content)
    with pytest.raises(InputError, match=r"a\.onnx"):
        reports.lifters(networks=["pcnet3d", str(tmp_path / "a.onnx")], output=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_network_is_given_once(tmp_path):
    with pytest.raises(InputError, match="twice"):
        lifters.opened(["pcnet3d", "pcnet3d"])


@pytest.mark.data("accad_mocap.npz", "tennis_mocap.npz")
def test_parts_of_the_validation(data):
    found = lifter_takes.materials(2)
    assert len({(one.part, one.views, one.seed) for one in found}) == len(found)
    assert {one.part for one in found} == {"CMU val", "ACCAD m1", "Tennis val"}
    assert {one.part for one in lifter_takes.materials(1, ["CMU val"])} == {"CMU val"}
    with pytest.raises(InputError, match="expected CMU val"):
        lifter_takes.materials(1, ["HDM05"])


def test_a_mean_over_frames_is_drawn_by_people():
    """Of people with equally many values, the interval of their means; of one person, none."""
    values = np.array([1.0, 2.0, 3.0, 4.0, np.nan])
    found = pooled(values, list("aabba"))
    assert (found["low"], found["high"]) == interval(np.array([1.5, 3.5]))
    assert found["mean"] == 2.5
    assert np.isnan(pooled(values, ["a"] * 5)["low"])
