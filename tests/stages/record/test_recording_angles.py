"""Angles in the recording."""

from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.pipeline.signals.angles import ANGLES, OF_BOTH

ORIGIN = "ViewBlueprint:space_origin"


def columns(**given):
    rows = {"r_knee_flexion_deg": np.arange(12.0), "l_knee_flexion_deg": np.arange(12.0) * 2}
    return {**rows, "r_knee_flexion_reason": np.zeros(12, "i1"), **given}


def test_both_sides_of_an_angle_in_one_view(taken):
    recording = taken(kinematics=columns())[1]
    frame, _, values = recording.over_time("angles/knee_flexion", "Scalars:scalars")
    np.testing.assert_array_equal(values, np.stack([np.arange(12), 2 * np.arange(12)], axis=1))
    assert frame.tolist() == list(range(5, 17))[: len(frame)]
    names = recording.static("angles/knee_flexion", "SeriesLines:names")
    assert names == ["r_knee_flexion (deg)", "l_knee_flexion (deg)"]
    assert "angles/knee_flexion" in recording.blueprint(ORIGIN)


def test_every_angle_has_a_view_in_its_group(taken):
    blueprint = taken(kinematics={f"{name}_deg": np.arange(12.0) for name in ANGLES})[1].blueprint(ORIGIN)
    assert {f"angles/{name}" for name in OF_BOTH} <= set(blueprint)


def test_the_band_where_it_is_stated(taken):
    assert "angles/knee_flexion/low" not in taken(kinematics=columns())[1].entities
    recording = taken(kinematics=columns(r_knee_flexion_sd_deg=np.full(12, 2.0)))[1]
    low, high = (
        np.array(recording.over_time(f"angles/knee_flexion/{end}", "Scalars:scalars")[2])
        for end in ("low", "high")
    )
    np.testing.assert_allclose(low[:, 0], np.arange(12) - 3.29)
    np.testing.assert_allclose(high[:, 0], np.arange(12) + 3.29)
    assert np.isnan(low[:, 1]).all()


@pytest.mark.parametrize(("dropped", "marked"), [(0, []), (2, [6])])
def test_poses_of_every_second_frame_have_gaps_where_one_is_lost(make_take, read_back, dropped, marked):
    take = make_take()
    clock = 2 * np.arange(12)
    clock[6:] += dropped
    told = {"frame_index": clock, "time_s": clock / 25}
    rectified = replace(take.rectified, level=take.rectified.level.with_(**told))
    keypoints = take.keypoints.with_(frame_index=clock[-1] - 10 + np.arange(12))  # they end a frame later
    take = take.with_(
        poses=take.poses.with_(**told), rectified=rectified, keypoints=keypoints, kinematics=columns()
    )
    recording = read_back(take)
    _, _, angles = recording.over_time("angles/knee_flexion", "Scalars:scalars")
    assert np.flatnonzero(np.isnan(angles).any(axis=1)).tolist() == marked
    _, _, joints = recording.over_time("level/joints", "Points3D:positions")
    assert np.flatnonzero(np.isnan(joints).any(axis=(1, 2))).tolist() == marked


@pytest.mark.parametrize("kinematics", [None, {"r_knee_flexion_deg": np.full(12, np.nan)}])
def test_no_angles_no_view(taken, kinematics):
    recording = taken(kinematics=kinematics)[1]
    assert not any(entity.startswith("angles") for entity in recording.entities)
    assert not any(origin.startswith("angles") for origin in recording.blueprint(ORIGIN))
