"""What a finished take states, beside a truth that knows it (a take built from the truth with errors that are known),
and the one procedure by which stated errors are judged and fitted."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.virtual import walked
from pcnet3d.models.angle_error.posture import POSTURES
from pcnet3d.models.lab import beds
from pcnet3d.models.lab.beds import Configuration, finished
from pcnet3d.models.lab.cases import Cases, grouped, summed
from pcnet3d.models.lab.evaluation import errors as module
from pcnet3d.models.lab.evaluation.errors import (
    angles,
    fitted,
    held_out,
    joints,
    motions,
    of_figures,
    of_strangers,
    paths,
    place,
    rotation,
    same_rows,
    statements,
    together,
    up,
)
from pcnet3d.pipeline.core.camera import Camera
from pcnet3d.pipeline.core.measures import SD_90, Measure, Measures, Moments
from pcnet3d.pipeline.core.pose import MadeBy, RootPath
from pcnet3d.pipeline.core.rotations import rotate
from pcnet3d.pipeline.signals.angles import ANGLES


@pytest.fixture(scope="module")
def exact():
    """The captured joints after a run that was told up, as if a lifter had made them."""
    clip = walked(seconds=4)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(beds, "read_clips", lambda subjects: (clip,))
        one = next(
            finished(Configuration(people="test", lifter="", up_told=True, focal_known=True, bed="typical"))
        )
    return with_(one, poses=one.take.poses.with_(made_by=MadeBy("estimated", "known errors")))


def with_(one, **changes):
    """With another take."""
    return replace(one, take=one.take.with_(**changes))


def share(stated: Cases, factor: float = 1.0) -> float:
    return module.inside([stated.having(half=factor * stated["half"])])["inside"]


def just_inside(stated: Cases) -> bool:
    """Whether all cases are inside their bars, and none inside half of these."""
    return (share(stated), share(stated, 0.5)) == (1, 0)


def test_errors_just_inside_their_bars_are_inside_and_outside_of_half_the_bars(exact):
    columns, frames = dict(exact.take.kinematics), int((~exact.truth.lying).sum())
    for name in ANGLES:
        columns[f"{name}_deg"] = columns[f"{name}_deg"] + 30.0
        columns[f"{name}_sd_deg"] = np.full(len(exact.rows), 33.0 / SD_90)
    found = together(angles(with_(exact, kinematics=columns)))
    assert {"knee_flexion", "trunk_lean_frontal"} <= set(found)
    for name, one in found.items():
        assert just_inside(one), name
        assert module.factor([one]) == pytest.approx(30 / 33, rel=0.05)
        assert 0.8 * frames <= len(one) <= 2 * frames


def test_bars_are_judged_posture_by_posture_people_who_lie_count_and_an_instant_does_not():
    """Only upright frames counted, while lying people had bars as well."""

    def shares(*takes):
        """Of 30 degrees of error. takes: (person, frames by posture, bar)."""
        pairs = []
        for person, frames, half in takes:
            posture = np.concatenate([np.full(count, POSTURES.index(name)) for name, count in frames.items()])
            values = {"error": np.full(len(posture), 30.0), "half": np.full(len(posture), half)}
            pairs += module.by_posture(Cases(person, values | {"posture": posture, "speed": 0.0 * posture}))
        return {name: module.summary(of) for name, of in grouped(pairs).items()}

    found = shares(("a", {"upright": 100}, 33.0), ("a", {"lying": 100}, 15.0))
    assert [found[name]["inside"] for name in ("upright", "lying", "all")] == [1, 0, 0.5]
    assert "crouched" not in found
    brief, low, instant = {"crouched": 14, "upright": 86}, {"crouched": 100}, {"crouched": 1}
    found = shares(("b", brief, 15.0), ("c", low, 33.0), ("c", instant, 33.0))
    crouched = [found["crouched"][name] for name in ("people", "inside", "cases")]
    assert crouched == [1, 1.0, 101]  # all that a take has to say
    assert found["upright"]["inside"] == 0


def test_whatever_is_stated_is_judged_posture_by_posture(exact, captured_walk):
    """Angles alone were, while joints of people who crouch and places of bent ones held in a half."""
    whole = with_covariance(placed(exact, 1.0, 0.01), 0.0, 0.01 * np.eye(3))
    whole = with_(whole, camera=replace(whole.take.need("camera"), focal_source="prior"))
    figures = together(of_figures(captured_walk))
    assert all(abs(one["error"]) < one["half"] for one in figures.values())
    assert not {"step length, m", "walking speed, m/s"} & set(
        figures
    )  # of captured poses these have no errors
    found = statements(whole) | figures
    asked = {"joints", "up", "focal length, %", "body's size, %", "double support, %"}
    assert asked <= set(found)
    for name, one in found.items():
        assert set(one.values) >= {"posture", "speed"}, name
        assert np.isin(one["posture"], range(len(POSTURES))).all(), name
        assert all(len(values) == len(one) for values in one.values.values()), name


def test_a_figure_of_many_frames_is_judged_by_the_posture_that_a_fifth_of_its_own_reach(exact):
    low, time_s, one = POSTURES.index("crouched"), exact.times, replace(exact)
    stances = np.where(time_s >= 3, low, 0), np.where(time_s > 3.8, np.nan, time_s)
    one.__dict__["stances"] = dict(zip(("posture", "speed"), stances, strict=True))
    assert (one.reached()["posture"], one.reached((0.0, 3.5))["posture"]) == (low, 0)
    assert one.reached()["speed"] == pytest.approx(0.8 * 3.8, abs=0.05)
    assert np.isnan(one.reached((20.0, 30.0))["posture"])


def test_up_is_one_case_a_take_and_rotations_are_as_wrong_as_they_were_made(exact):
    truth, frames = exact.truth, len(exact.rows)
    R = truth.R_camera_from_world
    about_z = Rotation.from_euler("z", 10, degrees=True).as_matrix()
    rectified = replace(
        exact.take.need("rectified"),
        R_source_from_level=Rotation.from_rotvec(np.radians(6) * R[:, 0]).as_matrix() @ R,
        up_bound_deg=np.full(frames, 7.0),
        R_source_from_body=truth.R_camera_from_body @ about_z,
        error_deg=np.full(frames, 6.0),
    )
    one = with_(exact, rectified=rectified)
    tilt, turn = up(one), rotation(one)
    assert tilt["error"] == pytest.approx([6.0])
    assert turn["error"] == pytest.approx(np.full(frames, 10.0), abs=1e-3)
    assert just_inside(tilt)
    assert just_inside(turn)
    assert tilt.person == truth.subject


def with_covariance(one, off, covariance):
    """With joints (T, 17, 3) in LEVEL off the truth, and the covariance (3, 3) of each."""
    take, truth = one.take, one.truth.truth
    covariance = np.broadcast_to(covariance, (*truth.shape, 3))
    R = take.need("rectified").R_source_from_level
    wrong = take.need("filtered").with_(joints=rotate(R.T, truth) + off, covariance=covariance)
    level = replace(take.need("rectified"), level=take.need("rectified").level.with_(covariance=covariance))
    camera = Camera((1920, 1080), 1500.0, 100.0, "told")
    return with_(one, filtered=wrong, rectified=level, camera=camera)


def test_gaussian_errors_lie_inside_their_ellipsoids_in_nine_of_ten(exact):
    rng = np.random.default_rng(0)
    root = np.array([[0.02, 0.0, 0.0], [0.01, 0.03, 0.0], [0.0, 0.02, 0.05]])
    off = rng.standard_normal(exact.truth.truth.shape) @ root.T
    off[:, 0] = 0

    def one(factor):
        return next(joints(with_covariance(exact, off, factor**2 * root @ root.T)))[1]

    assert share(one(1.0)) == pytest.approx(0.9, abs=0.02)
    assert share(one(0.5)) < 0.5
    assert module.factor([one(0.5)]) == pytest.approx(2.0, rel=0.05)
    assert list(joints(exact)) == []


def test_only_joints_and_place_are_judged_of_a_take_without_level_and_nothing_of_a_refused_one(exact):
    stated = with_covariance(exact, 0.0, 0.01 * np.eye(3))
    refused = replace(stated.take.need("rectified"), level_ok=False, level_reason="lying")
    found = [*statements(with_(stated, rectified=refused))]
    assert found[:3] == ["joints", "joints in depth", "joints across"]
    assert all(name.startswith(("pelvis", "body's size")) for name in found[3:])
    assert statements(replace(exact, take=None)) == {}


def placed(exact, factor, sd):
    """With the pelvis `factor` times as far away."""
    covariance = np.tile(sd**2 * np.eye(3), (len(exact.rows), 1, 1))
    path = RootPath(factor * exact.truth.joints_camera[:, 0], covariance, (0.037, 0.0))
    return with_(exact, poses=exact.take.need("poses").with_(path=path))


def test_a_path_ten_per_cent_too_far_is_wrong_along_the_ray_and_a_focal_length_as_much(exact):
    distance = np.linalg.norm(exact.truth.joints_camera[:, 0], axis=1)
    along, across, size = together(place(placed(exact, 1.1, 0.01))).values()
    np.testing.assert_allclose(along["error"], 0.1 * distance, rtol=1e-5)
    np.testing.assert_allclose(across["error"], 0, atol=1e-5)
    assert (share(along), share(across), len(across)) == (0, 1, 2 * len(exact.rows))
    assert size["error"] == pytest.approx([0.0], abs=1e-3)
    assert [share(one) for one in together(place(placed(exact, 1.0, 0.01))).values()] == [1, 1, 1]
    camera = replace(exact.take.need("camera"), focal_px=1.1 * exact.truth.focal_px, focal_sd_px=1.0)
    guessed = with_(exact, camera=replace(camera, focal_source="prior"))
    assert dict(paths(guessed))["focal length, %"]["error"] == pytest.approx([100 * (1 - 1 / 1.1)])
    assert "focal length, %" not in dict(paths(exact))  # told


def test_motions_are_judged_axis_by_axis_in_the_level_that_was_found(exact):
    columns = dict(exact.take.kinematics)
    for name in [name for name in columns if name[-2:-1] in "_va" and name[-1] in "xyz"]:
        columns[f"{name}_sd"] = np.full(len(exact.rows), 0.01)
        columns[name] = columns[name] + 0.5 * name.endswith(("wrist_x", "wrist_y", "wrist_z"))
    found = together(motions(with_(exact, kinematics=columns)))
    assert len(found) == 6
    moved = found["wrist position, m"]
    assert len(moved) == 6 * int((~exact.truth.lying).sum())
    assert np.median(moved["error"]) == pytest.approx(0.5, abs=0.03)
    assert share(moved) == 0
    assert np.median(np.abs(found["ankle position, m"]["error"])) < 0.02


def repeated(*peaks, mean_rise=90.0):
    """Rows of a movement whose repetitions reach their peak at (seconds, degrees)."""
    rows = [Measure("peak", height, 2.0, number=i) for i, (_, height) in enumerate(peaks)]
    rows += [
        Moments(name, tuple(at + off for at, _ in peaks)) for name, off in (("start", -0.5), ("stop", 0.5))
    ]
    return Measures((*rows, Measure("mean_rise", mean_rise, 2.0)))


def test_repetitions_are_compared_with_those_of_the_same_time_and_means_of_as_many():
    true = repeated((1.0, 90.0), (2.0, 80.0), (3.0, 100.0))

    def off(*peaks):
        return [
            (name, row.value - of.value)
            for name, row, of in same_rows(repeated(*peaks, mean_rise=80.0), true)
        ]

    others = off((2.1, 85.0), (3.0, 97.0), (9.0, 50.0))
    assert others == [("peak, deg", 5.0), ("peak, deg", -3.0)]
    assert ("mean rise, deg", -10.0) in off((1.0, 90.0), (2.0, 80.0), (3.0, 100.0))
    assert off((2.1, 85.0)) == [("peak, deg", 5.0)]
    assert off() == []


def stated(person: str, error: np.ndarray, **known: np.ndarray) -> Cases:
    return Cases(person, {"error": error, "half": np.ones(error.shape), **known})


def test_every_person_counts_the_same_and_every_take_of_a_person():
    long, short = stated("a", np.zeros(1000)), stated("b", np.full(10, 2.0))
    assert module.inside([long, short])["inside"] == pytest.approx(0.5)
    both = [stated("a", np.zeros(1000)), stated("a", np.full(3, 2.0)), short]
    assert module.inside(both)["inside"] == pytest.approx(0.25)
    assert module.inside(both)["cases"] == 1013
    rng = np.random.default_rng(0)
    takes = [stated("a", rng.normal(0, 1, 20_000)), stated("b", rng.normal(0, 3, 200))]
    by = module.factor(takes)
    wider = [take.having(half=by * take["half"]) for take in takes]
    assert module.inside(wider)["inside"] == pytest.approx(0.9, abs=0.01)
    assert by > 3.0  # b's errors count as much as a's, who was filmed longer


def test_cases_of_many_takes_are_added_up_and_one_without_a_bar_is_not_outside_of_it():
    half, true = np.array([2, 2, np.nan, 1]), np.array([2, 4, 6, 5])
    figures = summed([stated("a", np.array([1, 3, -2, 0]), true=true).having(half=half)])
    assert (figures["count"], figures["true"], figures["bias"]) == (4, 4.5, 0.5)
    assert (figures["error"].p50, figures["error"].mean) == (1.5, 1.5)
    assert figures["inside"] == pytest.approx(2 / 3)


def squares(take: Cases) -> np.ndarray:
    return np.stack([take["own"] ** 2, take["by"] ** 2], axis=1)


def test_fitted_bars_hold_at_every_size_on_people_left_out_and_in_every_unit():
    """A part of metres is as much a part as one of millimetres."""
    rng, takes = np.random.default_rng(2), []
    for person in "abcdef":
        by = rng.uniform(0.5, 4, 600)
        takes.append(stated(person, rng.normal(0, np.hypot(2.0, 1.5 * by)), by=by, own=np.ones(600)))
    weights = fitted(takes, squares)
    assert np.sqrt(weights) / 1.645 == pytest.approx([2.0, 1.5], rel=0.25)
    assert module.inside(held_out({"all": takes}, squares)["all"])["inside"] == pytest.approx(0.9, abs=0.03)
    own = [take.having(half=np.sqrt(squares(take) @ weights)) for take in takes]
    for low in (0.5, 2.0, 3.5):
        parts = [take.where((take["by"] >= low) & (take["by"] < low + 0.5)) for take in own]
        assert module.inside(parts)["inside"] > 0.8
    small = [take.having(error=1e-3 * take["error"]) for take in takes]
    np.testing.assert_allclose(fitted(small, squares), 1e-6 * weights, rtol=0.01)


def test_of_strangers_each_person_has_the_bars_of_all_the_others_and_of_one_person_there_are_none():
    def rate(person: str, size: float) -> Cases:
        error = size * np.random.default_rng(0).normal(size=250)
        return stated(person, error, rate=np.zeros(250), model=np.ones(250), faster=np.zeros(250))

    calm, wild, name = rate("a", 1.0), rate("b", 100.0), "rate of knee_flexion"
    groups = {"one": [calm], "other": [wild]}
    found = {group: share for _, group, share in of_strangers({name: groups})}
    assert found["one"] == 1.0  # by the bars of the wild one
    assert found["other"] < 0.1
    assert list(of_strangers({name: {"one": [calm]}})) == []
