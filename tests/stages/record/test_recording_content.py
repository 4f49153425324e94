"""The recording holds what the take holds, on both time axes, in a few whole columns."""

import shutil
from dataclasses import replace

import numpy as np
import pytest

from golden.recordings import Recording
from pcnet3d.pipeline import InputError, Pipeline, notice, own_notice
from pcnet3d.pipeline.core.pose import RootPath
from pcnet3d.stages.record.stage import Record, record

NAME, ORIGIN = "ViewBlueprint:display_name", "ViewBlueprint:space_origin"
TAB = "ContainerBlueprint:display_name"


def same(values, expected):
    np.testing.assert_array_equal(np.array(values, np.float32), expected)


def test_skeletons_on_both_time_axes(taken):
    take, recording = taken()
    skeletons = {"source": take.poses, "body": take.rectified.body, "level": take.rectified.level}
    for entity, poses in {**skeletons, "video/keypoints": take.keypoints}.items():
        points = "Points2D" if poses is take.keypoints else "Points3D"
        frame, nanoseconds, positions = recording.over_time(f"{entity}/joints", f"{points}:positions")
        same(positions, poses.joints)
        np.testing.assert_array_equal(frame, poses.frame_index)
        np.testing.assert_array_equal(nanoseconds, np.round(poses.times * 1e9))
        assert recording.static(f"{entity}/joints", f"{points}:labels") == list(poses.layout.joints)


def test_bones_join_the_joints_they_name(taken):
    take, recording = taken()
    for entity, poses, archetype in (
        ("level", take.rectified.level, "LineStrips3D"),
        ("video/keypoints", take.keypoints, "LineStrips2D"),
    ):
        _, _, strips = recording.over_time(f"{entity}/bones", f"{archetype}:strips")
        expected = [[poses.joint(end) for end in bone] for bone in poses.layout.bones]
        same(strips, np.moveaxis(expected, 2, 0))


def test_a_take_of_nothing_but_gaps_is_recorded(taken, make_take):
    take = make_take()
    nothing = np.full_like(take.poses.joints, np.nan)
    rectified = replace(
        take.rectified,
        level=take.rectified.level.with_(joints=nothing),
        R_source_from_body=np.full((12, 3, 3), np.nan),
        R_source_from_level=np.full((3, 3), np.nan),
        up_votes=None,
        up_bound_deg=None,
    )
    _, recording = taken(poses=take.poses.with_(joints=nothing), rectified=rectified)
    assert np.isnan(recording.over_time("level/joints", "Points3D:positions")[2]).all()


def test_gaps_end_what_is_shown(taken, make_take):
    """Behind rows 2 (frame 7; frame 8 missing) and at the end, where the keypoints go on, a row of NaN."""
    take = make_take()
    kept = [0, 1, 2, 4, 5]
    sparse = take.poses.with_(
        joints=take.poses.joints[kept],
        confidence=None,
        frame_index=take.poses.frame_index[kept],
        time_s=take.poses.times[kept],
    )
    rectified = replace(
        take.rectified,
        level=sparse.with_(joints=take.rectified.level.joints[kept], frame=take.rectified.level.frame),
        R_source_from_body=take.rectified.R_source_from_body[kept],
        error_deg=np.full(5, np.nan),
        up_error_deg=take.rectified.up_error_deg[kept],
        up_bound_deg=take.rectified.up_bound_deg[kept],
        up_votes=take.rectified.up_votes[kept],
    )
    events = (notice("seam", rows=[3], where="here"),)
    _, recording = taken(poses=sparse, rectified=rectified, notices=events)
    frame, nanoseconds, positions = recording.over_time("level/joints", "Points3D:positions")
    assert frame.tolist() == [5, 6, 7, 8, 9, 10, 11]
    np.testing.assert_allclose(nanoseconds, frame / 25 * 1e9, atol=1)
    assert np.flatnonzero(np.isnan(positions).any(axis=(1, 2))).tolist() == [3, 6]
    values = np.array(recording.over_time("rotation/bound", "Scalars:scalars")[2])
    assert np.flatnonzero(np.isnan(values).any(axis=1)).tolist() == [3, 6]
    assert recording.over_time("video/keypoints/joints", "Points2D:positions")[0].tolist() == list(
        range(5, 17)
    )
    assert recording.over_time("events", "TextLog:text")[0].tolist() == [9]  # row 3 of the take itself


def test_events_stand_at_their_frames(taken):
    events = (
        own_notice("test.said", "wrists exchanged", "repair", rows=[3]),
        own_notice("test.said", "no scale"),
        notice("seam", rows=[1], where="here"),
    )
    take, recording = taken(notices=events)
    frame, nanoseconds, texts = recording.over_time("events", "TextLog:text")
    assert [text for (text,) in texts] == [
        "warning: no scale",
        "seam: The estimator started a new clip here.",
        "repair: wrists exchanged",
    ]
    assert frame.tolist() == take.poses.frame_index[[0, 1, 3]].tolist()
    np.testing.assert_array_equal(nanoseconds, np.round(take.poses.times[[0, 1, 3]] * 1e9))
    levels = [level for (level,) in recording.over_time("events", "TextLog:level")[2]]
    assert levels == ["WARN", "INFO", "INFO"]


def test_views_follow_what_there_is(taken):
    _, recording = taken()
    persons = {"walk/along", "source", "body"}
    assert set(recording.blueprint(ORIGIN)) == {"video", *persons, "rotation", "provenance"}
    assert {"First look", "Details"} <= set(recording.blueprint(TAB))
    assert "2D keypoints" in recording.blueprint(NAME)
    assert recording.blueprint("TimePanelBlueprint:timeline") == ["video_time"]
    # Without a place the person stands still, on the floor under the ankles.
    walks = {entity for entity in recording.entities if entity.startswith("walk")}
    assert walks == {"walk/along", "walk/floor"}
    assert not np.any(recording.over_time("level", "Transform3D:translation")[2])
    eyes = recording.blueprint("EyeControls3D:position")
    assert [eye for eye in eyes if eye[0] < -1]  # the person faces -x in BODY and in LEVEL
    _, recording = taken(keypoints=None, notices=(own_notice("test.said", "said", "note"),))
    assert "video" not in recording.blueprint(ORIGIN)
    assert "events" in recording.blueprint(ORIGIN)
    assert not any(entity.startswith("video") for entity in recording.entities)


def test_long_takes_are_in_few_chunks(make_take, read_back):
    """Row by row they took minutes."""
    recording = read_back(make_take(10_000))
    assert sum(not chunk.is_static for chunk in recording.chunks) <= 40
    batches = recording.batches("level/joints", "Points3D:positions", static=False)
    assert sum(len(batch) for batch in batches) == 10_000


def test_it_says_where_it_comes_from(taken):
    inputs = ({"role": "poses", "file": "X3D.npy", "sha256": "abc", "adapter": "motionbert"},)
    _, recording = taken(notices=(own_notice("test.said", "no scale"),), inputs=inputs)
    (text,) = recording.static("provenance", "TextDocument:text")
    assert all(said in text for said in ("X3D.npy", "no scale", "geometric", "LEVEL (x back"))


def test_stage(make_take, tmp_path):
    stage = Record(tmp_path / "new" / "folder")
    take = make_take()
    assert Pipeline((stage,))(take).notices == ()
    assert "level/joints" in Recording(tmp_path / "new" / "folder" / "take.rrd").entities
    assert [file.name for file in stage.folder.iterdir()] == ["take.rrd"]
    with pytest.raises(InputError, match="rectified"):
        Pipeline((stage,))(take.with_(rectified=None))


def test_a_person_whose_place_is_known_walks_through_the_room(taken, make_take):
    take = make_take()
    root = np.stack([np.linspace(4, 2, 12), 0 * np.arange(12), 1 + 0 * np.arange(12)], axis=-1)
    root[6] = np.nan
    level = take.rectified.level.with_(path=RootPath(root))
    _, recording = taken(rectified=replace(take.rectified, level=level))
    same(np.squeeze(recording.over_time("level", "Transform3D:translation")[2]), root.astype(np.float32))
    strips = recording.static("walk/path", "LineStrips3D:strips")
    same(
        [point[:2] for strip in strips for point in strip],
        np.delete(root, 6, axis=0)[:, :2].astype(np.float32),
    )
    assert len(strips) == 2
    assert len({point[2] for strip in strips for point in strip}) == 1
    assert "walk" in recording.blueprint(ORIGIN)


def test_a_disk_without_room_is_told_before_the_work(make_take, tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 10**9, 1000))
    with pytest.raises(InputError, match=r"needs about 1 MB and .* has 0 MB left; make"):
        record(make_take(), tmp_path / "take.rrd")
    assert not list(tmp_path.iterdir())


def test_a_recording_that_was_cut_off_is_told(make_take, tmp_path, monkeypatch):
    monkeypatch.setattr("pcnet3d.stages.drawing.rerun_file._END", b"another end")
    with pytest.raises(InputError, match="could not be written to its end; is the disk full"):
        record(make_take(), tmp_path / "take.rrd")
    assert not list(tmp_path.iterdir())
