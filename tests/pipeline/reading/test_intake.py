"""Joining files: the clock, the frame numbers and the person, from what each file knows."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from golden.detections import drawn_tracks
from golden.films import film
from pcnet3d.adapters import read
from pcnet3d.pipeline import CAMERA, H36M17, InputError, PoseSequence
from pcnet3d.pipeline.core.take import Video
from pcnet3d.pipeline.reading.load import find_adapter
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import numbered_by_times, open_take
from refusals import refused

ROWS = 30
IN_METRES = {"layout": "H36M17", "frame": "CAMERA", "unit": "m"}


@pytest.fixture
def lifted(tmp_path, facing_camera):
    """An X3D.npy as MotionBERT writes it: rows without frame numbers, the root moving from depth 0."""
    path = np.linspace(0, 0.3, ROWS)[:, None, None] * [1, 0, 0]
    jitter = np.random.default_rng(0).normal(scale=0.002, size=(ROWS, 17, 3))
    jitter[0, 0] = 0
    np.save(tmp_path / "X3D.npy", (facing_camera * 0.8 + [0.1, 0.1, 0] + path + jitter).astype(np.float32))
    return tmp_path / "X3D.npy"


def test_dropped_frames_get_their_numbers_from_the_2d_file(tmp_path, lifted):
    frames = [f for f in range(ROWS + 2) if f not in (7, 8)]
    path = drawn_tracks(tmp_path / "ap.json", {1: frames})
    take = open_take(RunOptions(poses=lifted, keypoints=path, fps=25))
    assert take.poses.frame_index.tolist() == frames
    assert take.poses.frames_known
    np.testing.assert_allclose(take.poses.times, np.array(frames) / 25)
    np.testing.assert_allclose(take.keypoints.times, np.array(frames) / 25)


def test_the_track_that_fits_is_taken_when_there_are_several(tmp_path, lifted):
    path = drawn_tracks(tmp_path / "ap.json", {3: list(range(ROWS)), 5: list(range(4))})
    assert open_take(RunOptions(poses=lifted, keypoints=path, fps=25)).keypoints.person == "3"


def test_several_people_lifted_as_one_are_recognised(tmp_path, lifted):
    path = drawn_tracks(tmp_path / "ap.json", {1: list(range(20)), 2: list(range(10))})
    with refused("people-mixed"):
        open_take(RunOptions(poses=lifted, keypoints=path, fps=25))


def test_two_tracks_that_fit_need_a_name(tmp_path, lifted):
    path = drawn_tracks(tmp_path / "ap.json", {1: list(range(ROWS)), 2: list(range(ROWS))})
    with pytest.raises(InputError, match="--person"):
        open_take(RunOptions(poses=lifted, keypoints=path, fps=25))
    assert open_take(RunOptions(poses=lifted, keypoints=path, fps=25, person="2")).keypoints.person == "2"


def test_lengths_that_differ_cannot_be_joined(tmp_path, lifted):
    path = drawn_tracks(tmp_path / "ap.json", {1: list(range(ROWS - 5))})
    with pytest.raises(InputError, match="30 and 25 rows"):
        open_take(RunOptions(poses=lifted, keypoints=path, fps=25))


def timed_rows(path, bodies, fps):
    np.savez(path, joints=bodies, time_s=np.arange(ROWS) / fps, frame_index=np.arange(ROWS))
    return {"poses": path, "adapter": "arrays", "options": IN_METRES}


def warnings_of(**told):
    return " ".join(each.text for each in open_take(RunOptions(**told)).notices if each.weight == "warning")


@pytest.mark.parametrize(("fps", "times"), [(100, 0.25), (25.3, None)])
def test_times_of_a_file_that_contradict_the_video_are_not_passed_over(tmp_path, facing_camera, fps, times):
    """Slow motion: the poses know when they were captured, the video when it is shown."""
    clip = film(tmp_path / "a.mp4", range(0, 40 * ROWS, 40))
    own = timed_rows(tmp_path / "own.npz", np.tile(facing_camera, (ROWS, 1, 1)), fps)

    def contradicted(**told):
        notices = open_take(RunOptions(video=clip, **own, **told)).notices
        return [each.values["times"] for each in notices if each.code == "clocks-contradict"]

    assert contradicted() == ([] if times is None else [pytest.approx(times)])
    assert not contradicted(fps=fps)


@pytest.mark.parametrize("pause_ms", [2000, 8000])
def test_times_counted_at_the_rate_of_a_video_that_lacks_images_are_not_taken_for_slow_motion(
    tmp_path, facing_camera, pause_ms
):
    """It was to be read with --fps, which would close the pause."""
    stamps = np.arange(0, 40 * ROWS, 40) + pause_ms * (np.arange(ROWS) >= 15)
    clip = film(tmp_path / "a.mp4", stamps.tolist())
    average = (ROWS - 1) * 1000 / (stamps[-1] - stamps[0])
    for fps in (25, average):
        own = timed_rows(tmp_path / "own.npz", np.tile(facing_camera, (ROWS, 1, 1)), fps)
        assert "own times" not in warnings_of(video=clip, **own)


def test_a_rate_that_contradicts_the_file_is_told_beside_keypoints_too(tmp_path, facing_camera):
    own = timed_rows(tmp_path / "own.npz", np.tile(facing_camera, (ROWS, 1, 1)), 30)
    keypoints = drawn_tracks(tmp_path / "ap.json", {1: list(range(ROWS))})
    for beside in (None, keypoints):
        assert "--fps 25 was used, but the file says 30" in warnings_of(keypoints=beside, fps=25, **own)


def test_a_part_with_a_clock_of_its_own_is_not_taken_for_the_videos_beginning(facing_camera):
    """Rows of frames 200 to 299 whose times begin at 0 were laid on frames 0 to 99."""
    video = Video(Path("a.mp4"), 640, 480, np.arange(300) / 30, "h264")
    joints = np.tile(facing_camera, (300, 1, 1))
    for rows, known in ((100, False), (299, True)):
        poses = PoseSequence(joints[:rows], H36M17, CAMERA, time_s=np.arange(rows) / 30, frames_known=False)
        assert numbered_by_times(video, poses).frames_known == known


def test_unknown_frame_numbers_are_admitted_beside_what_has_them(tmp_path, lifted):
    """Poses alone belong to no frames of anything: their page warned of nothing that anybody could mend."""

    def said(**files) -> bool:
        take = open_take(RunOptions(poses=lifted, fps=25, **files))
        return "not-stated" in {each.code for each in take.notices if each.warns}

    clip = film(tmp_path / "clip.mp4", range(0, 40 * ROWS, 40))
    assert said(video=clip)
    assert not said()


def test_a_single_image_needs_no_rate(tmp_path, facing_camera):
    np.save(tmp_path / "X3D.npy", facing_camera[None] + [0.2, 0.2, 0])
    assert open_take(RunOptions(poses=tmp_path / "X3D.npy")).poses.times.tolist() == [0.0]
    np.savez(tmp_path / "own.npz", joints=facing_camera[None], time_s=[1.0], frame_index=[30])
    own = {"poses": tmp_path / "own.npz", "adapter": "arrays", "options": IN_METRES}
    take = open_take(
        RunOptions(**own, keypoints=drawn_tracks(tmp_path / "ap.json", {1: [30]}), time_range=":2")
    )
    assert take.keypoints.times.tolist() == take.poses.times.tolist() == [1.0]
    np.save(tmp_path / "X3D.npy", np.stack([facing_camera, facing_camera]) + np.array([0.2, 0.2, 0.0]))
    with refused("needs-rate"):
        open_take(RunOptions(poses=tmp_path / "X3D.npy"))


def test_rows_without_numbers_follow_first_frame_when_the_2d_file_is_longer(tmp_path, lifted):
    path = drawn_tracks(tmp_path / "ap.json", {1: list(range(ROWS + 50))})
    take = open_take(RunOptions(poses=lifted, keypoints=path, fps=25, first_frame=10))
    assert take.poses.frame_index.tolist() == list(range(10, 10 + ROWS))
    assert take.keypoints.frame_index[0] == 0


def test_what_the_refusal_of_numbers_that_count_from_one_says_to_do_puts_rows_where_they_belong(tmp_path):
    """Nobody was found in the first images, and the lowest number is that of another frame than the video's first."""
    clip = film(tmp_path / "a.mp4", range(0, 40 * 33, 33))
    shown = [f for f in range(12, 40) if f != 20]
    path = drawn_tracks(tmp_path / "ap.json", {1: [f + 1 for f in shown[3:]], 2: [f + 1 for f in shown]})
    with pytest.raises(InputError, match="count from 1") as refused:
        open_take(RunOptions(video=clip, keypoints=path, person="1"))
    first = int(re.search(r"read\.first_frame=(\d+)", str(refused.value))[1])
    take = open_take(RunOptions(video=clip, keypoints=path, person="1", first_frame=first))
    assert take.keypoints.frame_index.tolist() == shown[3:]
    for frames, first, said in (
        ((50, 60), None, "lowest number, 50, is"),
        ((5, 9), 35, "lowest number, 5, is"),
    ):
        drawn_tracks(path, {1: [*range(*frames), frames[1] + 1]})
        with pytest.raises(InputError, match=said):
            open_take(RunOptions(video=clip, keypoints=path, first_frame=first))


def test_first_frame_shifts_poses_and_the_keypoints_that_number_them(tmp_path, lifted):
    """A 2D file whose numbers begin with 1, with a gap, of two people; the second is seen from its third image on."""
    frames = [f + 1 for f in range(ROWS + 1) if f != 7]
    path = drawn_tracks(tmp_path / "ap.json", {1: frames, 2: frames[2:]})
    take = open_take(RunOptions(poses=lifted, keypoints=path, fps=25, first_frame=0))
    for rows in (take.poses, take.keypoints):
        assert rows.frame_index.tolist() == [f - 1 for f in frames]
    np.save(lifted, np.load(lifted)[: ROWS - 2])
    take = open_take(RunOptions(poses=lifted, keypoints=path, fps=25, first_frame=0))
    for rows in (take.poses, take.keypoints):
        assert rows.frame_index.tolist() == [f - 1 for f in frames[2:]]


def test_a_person_whose_name_is_a_number_may_be_asked_for_by_it(tmp_path):
    """Of person=2 it was said that there is no person '2', for there are 1 and 2."""
    path = drawn_tracks(tmp_path / "ap.json", {1: [0, 1], 2: [0, 1, 2]})
    for person in (2, "2"):
        assert len(read(path, person=person)) == 3


def test_a_person_who_is_in_no_file_is_refused(tmp_path, lifted):
    path = drawn_tracks(tmp_path / "ap.json", {1: list(range(ROWS))})
    with pytest.raises(InputError, match="no person '9'"):
        open_take(RunOptions(poses=lifted, keypoints=path, fps=25, person="9"))
    with pytest.raises(
        InputError, match=r"no person '9' in these files, only 0\."
    ):  # "found 0" was read as none
        open_take(RunOptions(poses=lifted, fps=25, person="9"))


def test_what_is_said_of_keypoints_is_said_beside_poses_too(tmp_path, lifted):
    path = drawn_tracks(tmp_path / "coco.json", {1: list(range(ROWS + 2))})
    entries = [
        {"image_id": i, "category_id": 1, "keypoints": entry["keypoints"], "score": 0.9, "track_id": 1}
        for i, entry in enumerate(json.loads(path.read_text()))
    ]
    for entry in entries[-2:]:
        del entry["track_id"]
    path.write_text(json.dumps(entries))
    alone, beside = (open_take(RunOptions(keypoints=path, poses=poses, fps=25)) for poses in (None, lifted))
    (said,) = [event.text for event in alone.notices if "2 detections of 32" in event.text]
    assert said in [event.text for event in beside.notices if event.weight == "warning"]


@pytest.mark.parametrize(
    ("spoil", "handedness", "kinds"),
    [
        ([1, 1, 1], "mirror", {"repair", "warning"}),
        ([-1, 1, 1], "mirror", {"repair"}),
        ([-1, 1, 1], "ignore", {"warning"}),
    ],
)
def test_what_was_asked_of_left_and_right_is_reported(lifted, spoil, handedness, kinds):
    np.save(lifted, np.load(lifted) * spoil)
    notices = open_take(RunOptions(poses=lifted, fps=25, first_frame=0, handedness=handedness)).notices
    assert {each.weight for each in notices if each.about == "left and right"} == kinds


def test_frames_without_a_pose_are_gaps_and_counted(lifted):
    joints = np.load(lifted)
    joints[4:6] = np.nan
    joints[9] = 0
    np.save(lifted, joints)
    events = open_take(RunOptions(poses=lifted, fps=25, adapter="motionbert")).notices
    (text,) = [event.text for event in events if event.weight == "repair"]
    assert "2 frames with NaN" in text
    assert "1 frame with all joints" in text


@pytest.mark.parametrize(
    "option", [{"fps": "30"}, {"handedness": "ignore"}, {"gives": "poses"}, {"path": "x"}]
)
def test_the_adapters_options_are_not_the_readers(lifted, option):
    with pytest.raises(InputError, match="no option"):
        open_take(RunOptions(poses=lifted, fps=25, options=option))


def test_millimetres_called_metres_are_doubted(tmp_path, facing_camera):
    np.save(tmp_path / "a.npy", np.repeat(facing_camera[None] * 1000, ROWS, axis=0))
    take = open_take(RunOptions(poses=tmp_path / "a.npy", adapter="arrays", fps=25, options=IN_METRES))
    assert "stature" in [said.code for said in take.said]
    for unit in ("m", "cm"):  # it said metres whatever the user had told
        told = {**IN_METRES, "unit": unit}
        take = open_take(RunOptions(poses=tmp_path / "a.npy", adapter="arrays", fps=25, options=told))
        assert f"is really {unit}." in next(said.text for said in take.said if said.code == "stature")


def _half_an_array(path):
    np.save(path, np.zeros((30, 17, 3), np.float32))
    path.write_bytes(path.read_bytes()[:3000])


@pytest.mark.parametrize(
    ("name", "write", "words"),
    [
        (
            "a.npz",
            lambda path: np.savez(path, a=np.zeros((3, 4)), b=np.array("x")),
            r"'a' \(\(3, 4\), float64\)",
        ),
        ("a.json", lambda path: path.write_text('{"poses": 3}'), "JSON that begins with '{\"poses"),
        ("a.csv", lambda path: path.write_text("time,hip_x"), "a file that begins with 'time,hip_x"),
        ("b.csv", lambda path: path.write_bytes("höhe\n1".encode()), "a file that begins with 'höhe"),
        ("a.doc", lambda path: path.write_bytes(b"\xd0\xcf"), r"no text(?!.*\\x)"),
        ("clip.mp4", lambda path: path.write_bytes(b"\x89PNG\r\n"), "a PNG image"),
        ("a.csv", lambda path: path.write_text("frame,x0\n", encoding="utf-16"), "save it as UTF-8"),
        ("a.mat", lambda path: path.write_bytes(b"MATLAB 5.0 MAT-file"), "save the joints as .npy"),
        ("a.webp", lambda path: path.write_bytes(b"RIFFF~\x0b\x00WEBPVP8X"), r"a WebP image(?!.*\\x)"),
        ("a", lambda path: path.mkdir(), "a folder without files"),
    ],
)
def test_a_file_that_nobody_recognises_is_described(tmp_path, name, write, words):
    write(tmp_path / name)
    with pytest.raises(InputError, match=f"it is .*{words}"):
        read(tmp_path / name)


@pytest.mark.parametrize(
    ("name", "write", "code"),
    [
        ("a.npy", lambda path: path.touch(), "file-damaged"),
        ("a.csv", lambda path: path.touch(), "file-damaged"),
        ("a.npy", lambda path: path.write_bytes(b"\x93NUMPY\x01"), "file-damaged"),
        ("a.npy", _half_an_array, "file-damaged"),
        ("a.npz", lambda path: path.write_bytes(b"PK\x03\x04"), "file-damaged"),
        ("a.json", lambda path: path.write_text('[{"x"'), "file-damaged"),
        ("a.npy", lambda path: np.save(path, np.zeros((0, 17, 3))), "nothing-usable"),
        ("a.npy", lambda path: np.save(path, [None]), "unsafe"),
    ],
)
def test_of_a_damaged_file_only_the_fault_is_said(tmp_path, name, write, code):
    write(tmp_path / name)
    for read_as in ("poses", None):
        with pytest.raises(InputError) as caught:
            find_adapter(tmp_path / name, gives=read_as)
        assert caught.value.code == code
        assert "adapter" not in str(caught.value)


def test_an_array_of_ones_own_is_told_how_to_come_in(tmp_path):
    path = tmp_path / "mine.npz"
    np.savez(path, pred=np.random.default_rng(0).normal(size=(20, 17, 3)))
    with pytest.raises(InputError) as caught:
        read(path)
    words = str(caught.value).partition("--adapter arrays ")[2].partition(",")[0].split()
    options = dict(word.split("=") for word in words if word != "-O")
    assert len(read(path, "arrays", fps=30, **options)) == 20


def test_the_wrong_adapter_names_the_right_one(lifted):
    with pytest.raises(InputError, match=r"X3D\.npy.* looks like a file for adapter motionbert\."):
        read(lifted, "ddhpose")
    with pytest.raises(InputError) as caught:
        read(lifted, "motionbert", fps=-1)
    assert "looks like" not in str(caught.value)
