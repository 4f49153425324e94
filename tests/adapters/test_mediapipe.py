"""MediaPipe's world landmarks as people save them, and image landmarks, which are refused (formats.md 5)."""

import numpy as np
import pytest

from golden import landmarks
from golden.bodies import hips_of, turning
from golden.films import film
from pcnet3d.adapters import read, read_all
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33
from pcnet3d.pipeline.reading.load import adapters
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take

FRAMES = 50


@pytest.fixture
def world() -> np.ndarray:
    """(T, 33, 4): the person who turns, hips' middle at the origin, with visibilities."""
    return landmarks.landmarks(turning(FRAMES))


NUMBERED = (landmarks.wide, landmarks.long_numbered, landmarks.tasks_json)
TIMED = (landmarks.wide_named, landmarks.long, landmarks.tasks_json)
WRITERS = (
    *NUMBERED, landmarks.wide_from_1, landmarks.wide_named, landmarks.wide_both, landmarks.long,
    landmarks.pose_world_json, landmarks.message_json, landmarks.bare_json,
)  # fmt: skip


@pytest.mark.parametrize("write", WRITERS)
def test_golden(tmp_path, world, write):
    path = write(tmp_path, world)
    poses = read(path)
    expected = turning(FRAMES) - hips_of(turning(FRAMES))
    for joint in ("r_hip", "l_knee", "r_ankle", "nose", "head", "l_shoulder", "r_elbow", "l_wrist"):
        np.testing.assert_allclose(poses.joint(joint), expected[:, H36M17.index(joint)], atol=1e-6)
    assert (poses.frame.name, poses.frame.unit, poses.frame.origin) == ("CAMERA", "m", "pelvis")
    assert poses.frames_known == (write in NUMBERED)
    assert poses.frame_index[0] == (3 if write in NUMBERED else 0)
    assert (poses.time_s is not None) == (write in TIMED)
    if write in TIMED:
        np.testing.assert_allclose(poses.times, 0.04 * np.arange(FRAMES), atol=1e-9)
    wrist = poses.confidence[:, H36M17.index("r_wrist")]
    np.testing.assert_allclose(wrist, np.nan if write is landmarks.wide_both else 16 / 40, atol=1e-6)


@pytest.mark.parametrize(
    "write", [writer for writer in WRITERS if writer not in (landmarks.wide_both, landmarks.tasks_json)]
)
def test_image_landmarks_are_recognised_and_refused(tmp_path, world, write):
    path = write(tmp_path, landmarks.image(world))
    assert [name for name, each in adapters().items() if each.sniff(path)] == ["mediapipe"]
    with pytest.raises(
        InputError, match=r"image landmarks, whose x and y are shares .* save pose_world_landmarks"
    ):
        read(path)


def test_image_landmarks_by_name_are_refused(tmp_path, world):
    for content in (
        [{"pose_landmarks": landmarks.points(row)} for row in world],
        {"pose_landmarks": [landmarks.points(world[0])]},
    ):
        path = landmarks.dump(tmp_path, content)
        with pytest.raises(InputError, match="expected world landmarks, got image landmarks"):
            read(path, "mediapipe")


@pytest.mark.parametrize("nobody", [-1.0, np.nan, None], ids=["-1", "NaN", "dropped"])
def test_frames_without_a_person(tmp_path, world, nobody):
    if nobody is None:
        header = ["frame", *[f"{axis}{i}" for i in range(33) for axis in "xyz"]]
        kept = [[i, *row[:, :3].ravel()] for i, row in enumerate(world) if i != 10]
        path = landmarks.write_csv(tmp_path / "a.csv", header, kept)
    else:
        world[10] = nobody
        path = landmarks.wide(tmp_path, world)
    frames = read(path).frame_index
    assert (frames - frames[0]).tolist() == [i for i in range(FRAMES) if i != 10]


@pytest.mark.parametrize("nobody", [None, []])
@pytest.mark.parametrize("timed", [False, True])
def test_json_frames_without_a_person_count(tmp_path, world, nobody, timed):
    frames = [
        {"pose_world_landmarks": nobody if i in (0, 10, 11) else landmarks.points(row)}
        for i, row in enumerate(world)
    ]
    if timed:
        frames = [{"timestamp_ms": 40 * i, **frame} for i, frame in enumerate(frames)]
    poses = read(landmarks.dump(tmp_path, frames))
    seen = [i for i in range(FRAMES) if i not in (0, 10, 11)]
    assert poses.frame_index.tolist() == seen
    assert not poses.frames_known
    if timed:
        np.testing.assert_allclose(poses.times, 0.04 * np.array(seen))


@pytest.mark.parametrize("fps", [25, 30])
def test_frames_that_a_clocked_table_lacks_leave_a_gap(tmp_path, world, fps):
    """Times in whole milliseconds, 33 and 34 at 30 frames a second, and no frame numbers."""
    kept = [i for i in range(400) if not 100 <= i < 300]
    header = ["timestamp_ms", *[f"{axis}{i}" for i in range(33) for axis in "xyzv"]]
    rows = [[round(1000 * i / fps) + 500, *world[i % FRAMES].ravel()] for i in kept]
    poses = read(landmarks.write_csv(tmp_path / "a.csv", header, rows))
    assert poses.frame_index.tolist() == kept
    assert not poses.frames_known
    assert poses.fps == pytest.approx(fps, rel=1e-3)


@pytest.mark.filterwarnings("error")
def test_two_kinds_of_steps_in_turn_are_counted_by_the_shorter(tmp_path, world):
    """A live stream that drops two of four: their median is neither."""
    header = ["timestamp_ms", *[f"{axis}{i}" for i in range(33) for axis in "xyzv"]]
    times = np.cumsum([0, *[33, 100] * 8])
    poses = read(
        landmarks.write_csv(tmp_path / "a.csv", header, [[t, *world[i].ravel()] for i, t in enumerate(times)])
    )
    assert np.diff(poses.frame_index).tolist() == [1, 3] * 8


def test_rows_with_times_are_the_videos_frames_at_these(tmp_path, world):
    """A phone's video lacks images, of which a row an image knows nothing but its time."""
    stamps = [40 * i for i in range(40) if i not in (10, 11, 25)]
    header = ["timestamp_ms", *[f"{axis}{i}" for i in range(33) for axis in "xyzv"]]
    rows = [[stamp, *world[i].ravel()] for i, stamp in enumerate(stamps)]
    del rows[5]  # nobody was found
    path = landmarks.write_csv(tmp_path / "a.csv", header, rows)
    take = open_take(RunOptions(poses=path, video=film(tmp_path / "a.mkv", stamps)))
    assert take.poses.frame_index.tolist() == [i for i in range(len(stamps)) if i != 5]
    assert take.poses.frames_known


@pytest.mark.parametrize("boxes", [True, False])
def test_people_are_separated(tmp_path, world, boxes):
    """Two people whose order is exchanged half-way."""
    other = world.copy()
    other[..., [0, 2]] = world[..., [2, 0]] * [-1, 1]  # turned by a quarter
    frames = []
    for i in range(FRAMES):
        shown = [landmarks.image(world)[i], landmarks.image(other)[i] + [0.4, 0, 0, 0]]
        people = [world[i], other[i]]
        order = (0, 1) if i < 25 else (1, 0)
        frame = {"frame": i, "pose_world_landmarks": [landmarks.points(people[p]) for p in order]}
        if boxes:
            frame["pose_landmarks"] = [landmarks.points(shown[p]) for p in order]
        frames.append(frame)
    people = read_all(landmarks.dump(tmp_path, frames))
    assert len(people) == 2
    for poses, expected in zip(people, (world, other), strict=True):
        wrist = BLAZEPOSE33.index("r_wrist")
        np.testing.assert_allclose(poses.joint("r_wrist"), expected[:, wrist, :3], atol=1e-6)
