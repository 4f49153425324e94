"""`pcnet3d live` on a file and on a pipe: what it knew at the time, what it makes of the take, and how it ends."""

from __future__ import annotations

import json
import re
import shutil
import signal
import subprocess
import time
from contextlib import nullcontext
from dataclasses import fields, replace
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from commands import APART
from golden import numbered
from pcnet3d.adapters import read_all
from pcnet3d.models.detector.protocols import Found
from pcnet3d.models.lifter.live import LiveLifter
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.rotations import unit
from pcnet3d.pipeline.files.detections import load_detections
from pcnet3d.pipeline.reading.load import read_video
from pcnet3d.pipeline.signals.swaps import kinds
from pcnet3d.stages.detect import Detect
from pcnet3d.stages.study.live.command import live
from pcnet3d.stages.study.live.source import Incoming, Shot, Source, open_source

GEOMETRIC = ["rectify.rectifier=geometric"]
QUICK = [*GEOMETRIC, "report=off"]  # takes of which no test opens the report


def logged(path, entity: str, component: str) -> tuple[np.ndarray, list]:
    """Frame numbers and values of an entity, in order."""
    from rerun.chunk import RrdReader

    frames, values = [], []
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        if chunk.entity_path == f"/{entity}" and not chunk.is_static and component in batch.schema.names:
            frames += batch.column("frame").to_pylist()
            values += batch.column(component).to_pylist()
    order = np.argsort(frames)
    return np.array(frames)[order], [values[i] for i in order]


@pytest.fixture(scope="module")
def from_file(numbered_film, toy_detector, tmp_path_factory):
    output = tmp_path_factory.mktemp("live") / "out"
    live(source=str(numbered_film), output=output, detector=str(toy_detector), settings=GEOMETRIC)
    return output


def test_every_frame_of_a_file_is_in_the_recording_with_its_keypoints(from_file, joints_px):
    frames, positions = logged(from_file / "live.rrd", "video/keypoints/joints", "Points2D:positions")
    assert frames.tolist() == list(range(60))
    np.testing.assert_allclose(np.array(positions), joints_px, atol=0.01)
    for entity in ("source", "body"):
        frames, positions = logged(from_file / "live.rrd", f"{entity}/joints", "Points3D:positions")
        assert frames.tolist() == list(range(60))
        assert np.isfinite(np.array(positions)[1:]).all()


def test_images_are_there_as_they_were_shown(from_file):
    import av

    frames, samples = logged(from_file / "live.rrd", "video", "VideoStream:sample")
    assert frames.tolist() == list(range(60))
    decoder = av.CodecContext.create("h264", "r")
    images = []
    for sample in samples:
        images += decoder.decode(av.Packet(bytes(np.ravel(sample).astype(np.uint8))))
    images += decoder.decode(None)
    corners = [image.to_ndarray(format="gray")[8:40, 8:40].mean() for image in images]
    np.testing.assert_allclose(corners, 8 + 4 * np.arange(60), atol=3)


def test_the_take_is_then_processed_as_by_run(from_file, joints_px):
    made = {path.name for path in from_file.iterdir()}
    assert {"live.rrd", "take.rrd", "keypoints.npz", "poses.npz", "report.html", "summary.json"} <= made
    assert "video.ts" not in made  # the file itself is there
    (person,) = read_all(from_file / "keypoints.npz")
    np.testing.assert_allclose(person.joints, joints_px, atol=0.01)
    with np.load(from_file / "poses.npz") as poses:
        assert poses["frame_index"].tolist() == list(range(60))
    device = json.loads((from_file / "summary.json").read_text())["device"]
    assert {"toy.onnx", "lifter.onnx"} <= device["networks"].keys()


def test_a_gravity_that_is_told_is_believed_from_the_first_frame_on(
    from_file, numbered_film, toy_detector, joints_px, tmp_path
):
    """It once reached the run at the end only."""
    up = np.array([0.3, -0.95, 0.1])
    told = {"settings": [*QUICK, "read.gravity=" + ",".join(map(str, -up))]}
    live(source=str(numbered_film), output=tmp_path / "out", detector=str(toy_detector), **told)
    bounds = [
        np.concatenate(logged(folder / "live.rrd", "rotation/bound", "Scalars:scalars")[1])
        for folder in (from_file, tmp_path / "out")
    ]
    assert np.nanmax(bounds[1]) < 2 < np.nanmin(bounds[0])
    film = read_video(numbered_film)
    lifters = [LiveLifter(COCO17, (film.width, film.height), up=each) for each in (unit(up), None)]
    expected, other = ([lifter.update(xy, np.full(17, 0.9)) for xy in joints_px][-1] for lifter in lifters)
    _, positions = logged(tmp_path / "out" / "live.rrd", "source/joints", "Points3D:positions")
    np.testing.assert_allclose(positions[-1], expected, atol=0.002)
    assert np.abs(other - expected).max() > 0.01


@pytest.mark.parametrize(("looks", "why"), [(0, "Expected 1 to 4 looks"), (2, "looks at everybody at once")])
def test_looks_that_cannot_be_are_refused_before_anything_is_recorded(
    numbered_film, toy_detector, tmp_path, looks, why
):
    """None at all was once silently one."""
    settings = [*QUICK, f"detect.looks={looks}"]
    with pytest.raises(InputError, match=why):
        live(
            source=str(numbered_film), output=tmp_path / "out", detector=str(toy_detector), settings=settings
        )
    assert not (tmp_path / "out").exists()


@pytest.fixture
def camera(monkeypatch, numbered_film):
    """A camera that shows the film; `camera(change)` one whose images are changed first."""

    def shows(change):
        def shots():
            for shot in open_source(str(numbered_film)).shots:
                yield replace(shot, image=change(shot.image))

        came = Source("camera", shots(), None, waits=True)
        monkeypatch.setattr("pcnet3d.stages.study.live.command.open_source", lambda *_: came)

    shows(lambda image: image)
    return shows


@pytest.fixture
def no_camera(camera):
    """One that must not be looked at."""

    def started(image):
        raise AssertionError

    camera(started)


@pytest.mark.parametrize(
    ("settings", "no_frames", "why"),
    [
        ("detect=off", False, "got detect=off"),
        ("lift=off", False, "keypoints and its video: Stage 'clean' needs poses"),
        ("rectify=off", False, "'trajectories' needs rectified"),
        ("lift.lifter=nothing.onnx", False, "nothing.onnx"),
        ("calibrate=off", True, "run of its keypoints: calibrate=off is for the stage 'calibrate'"),
        ("calibrate.camera_file=lens.toml", True, "calibrate.camera_file is for the stage 'calibrate'"),
    ],
)
def test_what_the_run_at_the_end_cannot_do_is_refused_before_anything_is_recorded(
    no_camera, tmp_path, settings, no_frames, why
):
    """The whole recording was once thrown away, or its take."""
    with pytest.raises(InputError, match=re.escape(why)):
        live(source="0", output=tmp_path / "out", settings=[settings], no_frames=no_frames)
    assert not any(tmp_path.iterdir())


def test_files_in_metres_of_a_person_without_a_height_are_refused_before_anything_is_recorded(
    no_camera, toy_detector, tmp_path
):
    """The whole recording once had no take for it."""
    told = {"detector": str(toy_detector), "settings": QUICK, "also": ("trc",)}
    with pytest.raises(InputError, match=r"run of its keypoints.*--also trc.*--stature"):
        live(source="0", output=tmp_path / "out", **told)
    assert not any(tmp_path.iterdir())
    with pytest.raises(AssertionError):  # the camera runs
        live(source="0", output=tmp_path / "out", stature=1.75, **told)


VALUES = {
    "person_kind": "yolox", "looks": "1", "swaps": "mask", "fps": "60",
    "folder": "there", "checkpoint": "part.npz", "resume": "part.npz", "person": "0",
}  # fmt: skip


@pytest.mark.parametrize("name", [field.name for field in fields(Detect)])
def test_every_option_of_detect_is_heard_or_refused_before_anything_is_recorded(
    no_camera, toy_detector, tmp_path, name
):
    heard = name in ("detector", "person_detector", "person_kind", "looks", "swaps")
    told = {"detect.detector": str(toy_detector), f"detect.{name}": VALUES.get(name, str(toy_detector))}
    settings = [*QUICK, *(f"{key}={value}" for key, value in told.items())]
    if heard and name != "person_detector":  # the toy finds people by itself, and says so
        with pytest.raises(AssertionError):
            live(source="0", output=tmp_path / "out", settings=settings)
        return
    with pytest.raises(InputError, match=f"detect.{name}"):
        live(source="0", output=tmp_path / "out", settings=settings)
    assert not any(tmp_path.iterdir())


def test_exchanged_limbs_are_put_right_in_the_run_at_the_end(camera, joints_px, tmp_path):
    wrong = joints_px.copy()
    for way in kinds(COCO17, depth=False):
        wrong[20:30] = way.applied(wrong[20:30])
    settings = [*QUICK, "read.swaps=repair"]
    toy = numbered.toy_detector(tmp_path / "toy.onnx", wrong)
    live(source="0", output=tmp_path / "out", detector=str(toy), settings=settings)
    said = json.loads((tmp_path / "out" / "summary.json").read_text())["notices"]
    (repaired,) = [each for each in said if each["code"] == "swaps-repaired"]
    assert "frames 20-29" in repaired["values"]["swaps"]


def test_images_with_odd_sides_get_their_take(camera, toy_detector, joints_px, tmp_path):
    """The video has even sides, and was once refused for it."""
    camera(lambda image: image[:-1, :-1])
    live(source="0", output=tmp_path / "out", detector=str(toy_detector), settings=QUICK)
    assert read_video(tmp_path / "out" / "video.ts").height == 358
    (person,) = read_all(tmp_path / "out" / "keypoints.npz")
    np.testing.assert_allclose(person.joints, joints_px, atol=1)
    with np.load(tmp_path / "out" / "poses.npz") as poses:
        assert poses["frame_index"].tolist() == list(range(60))


def test_the_lift_of_one_person_rests_on_nobody_else(numbered_film, joints_px, tmp_path, monkeypatch, capsys):
    """Somebody leaves, and somebody else is there, whose first skeletons rested on the other's keypoints."""
    moved = joints_px[:20] * 0.5
    frames = count()

    def people(image, before=()):
        frame = next(frames)
        xy = joints_px[frame] if frame < 20 else moved[frame - 51] if frame > 50 else None
        box = None if xy is None else np.r_[xy.min(axis=0), xy.max(axis=0)]
        return () if xy is None else (Found(xy, np.full(17, 0.9), box),)

    seen: list[list[float]] = []

    class Spy(LiveLifter):
        def __init__(self, *args, **told):
            super().__init__(*args, **told)
            seen.append([])

        def update(self, xy, score, time_s=None):
            seen[-1].append(float(np.nanmax(xy)) if np.isfinite(xy).any() else np.nan)
            return super().update(xy, score, time_s)

    toy = SimpleNamespace(method="toy@1", layout=COCO17, people=people)
    monkeypatch.setattr("pcnet3d.stages.study.live.command.load_detector", lambda *_: toy)
    monkeypatch.setattr("pcnet3d.stages.study.live.frames.LiveLifter", Spy)
    live(source=str(numbered_film), output=tmp_path / "out", settings=QUICK)
    first, second = seen
    assert len(first) == 51
    np.testing.assert_allclose(second, moved[:9].max(axis=(1, 2)), rtol=1e-5)
    said = capsys.readouterr().err
    assert "60 frames, latency" in said
    assert "; of 2 people person 0, who was shown most, is taken" in said


def kept(folder) -> bool:
    """Whether all of the recording, and nothing of a take, is in the folder."""
    names = {path.name for path in folder.iterdir()}
    assert "take.rrd" not in names
    assert len(logged(folder / "live.rrd", "video", "VideoStream:sample")[0]) == 60
    return {"live.rrd", "video.ts", "summary.json"} <= names


@pytest.mark.parametrize(
    "error", [InputError("bad-value", "No."), RuntimeError("a fault"), KeyboardInterrupt()]
)
def test_whatever_fails_behind_the_camera_the_recording_is_kept(
    camera, toy_detector, tmp_path, monkeypatch, capsys, error
):
    def fails(*_):
        raise error

    monkeypatch.setattr("pcnet3d.stages.study.live.command.run_into", fails)
    told = {"detector": str(toy_detector), "settings": QUICK}
    ends = pytest.raises(RuntimeError, match="a fault") if isinstance(error, RuntimeError) else nullcontext()
    with ends:
        live(source="0", output=tmp_path / "out", **told)
    assert "recorded, but not processed as a take" in capsys.readouterr().err
    assert kept(tmp_path / "out")
    assert (tmp_path / "out" / "keypoints.npz").exists()


@pytest.mark.parametrize("no_frames", [False, True])
def test_a_video_in_which_nobody_was_found_is_kept_too(camera, tmp_path, capsys, no_frames):
    toy = numbered.toy_detector(tmp_path / "toy.onnx", score=0.0)
    told = {"detector": str(toy), "settings": QUICK, "no_frames": no_frames}
    with pytest.raises(InputError, match="Nobody was found in 60 frames") if no_frames else nullcontext():
        live(source="0", output=tmp_path / "out", **told)
    assert (tmp_path / "out").exists() != no_frames
    if not no_frames:
        assert "Nobody was found in 60 frames of camera" in capsys.readouterr().err
        assert kept(tmp_path / "out")


def test_a_network_in_the_folder_is_not_replaced_with_it(numbered_film, toy_detector, tmp_path):
    detector = tmp_path / "out" / "toy.onnx"
    detector.parent.mkdir()
    detector.write_bytes(toy_detector.read_bytes())
    with pytest.raises(InputError, match=r"toy\.onnx, which this run needs"):
        live(
            source=str(numbered_film),
            output=tmp_path / "out",
            detector=str(detector),
            settings=QUICK,
            force=True,
        )
    assert detector.exists()


def test_a_gravity_that_is_none_is_refused_before_anything_is_recorded(numbered_film, toy_detector, tmp_path):
    with pytest.raises(InputError, match="direction for gravity"):
        live(
            source=str(numbered_film),
            output=tmp_path / "out",
            detector=str(toy_detector),
            settings=["read.gravity=0,0,0"],
        )
    assert not any(tmp_path.iterdir())


def test_a_file_in_the_place_of_a_pipe_loses_no_frame_and_its_video_is_kept(
    numbered_film, toy_detector, tmp_path
):
    output = tmp_path / "out"
    command = [
        "live",
        "-",
        "-o",
        str(output),
        "--detector",
        str(toy_detector),
        "--set",
        "rectify.rectifier=geometric",
    ]
    with numbered_film.open("rb") as pipe:
        ended = subprocess.run([*APART, *command], stdin=pipe, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr
    assert "60 frames" in ended.stderr
    frames, _ = logged(output / "live.rrd", "body/joints", "Points3D:positions")
    assert frames.tolist() == list(range(60))
    assert (output / "video.ts").stat().st_size > 1000
    with np.load(output / "poses.npz") as poses:
        assert poses["frame_index"].tolist() == list(range(60))
        np.testing.assert_allclose(poses["time_s"], np.arange(60) / 30, atol=1e-3)


def test_ctrl_c_ends_the_take_and_it_is_processed(numbered_film, toy_detector, tmp_path):
    output = tmp_path / "out"
    command = ["live", "-", "-o", str(output), "--detector", str(toy_detector), "--no-frames"]
    command += ["--set", "rectify.rectifier=geometric"]
    with subprocess.Popen([*APART, *command], stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        sent = numbered_film.read_bytes()
        for part in range(0, len(sent), -(-len(sent) // 60)):  # as a camera would, and no end
            process.stdin.write(sent[part : part + -(-len(sent) // 60)])
            process.stdin.flush()
            time.sleep(0.05)
        until = time.monotonic() + 60
        while not any(tmp_path.glob(".out.partial-*/live.rrd")) and time.monotonic() < until:
            time.sleep(0.1)
        time.sleep(3)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    frames, _ = logged(output / "live.rrd", "body/joints", "Points3D:positions")
    assert len(frames) > 0  # how many is how fast the machine is
    names = {path.name for path in output.iterdir()}
    assert {"live.rrd", "take.rrd", "keypoints.npz"} <= names
    assert "video.ts" not in names
    assert logged(output / "live.rrd", "video", "VideoStream:sample")[1] == []


def test_of_a_camera_that_is_too_fast_only_the_newest_image_is_taken():
    def camera():
        for number in range(200):
            time.sleep(0.001)
            yield Shot(number, number / 1000, np.zeros((2, 2, 3), np.uint8))

    incoming = Incoming(Source("camera", camera(), None, waits=False))
    times = []
    for expected, shot in zip(count(), incoming.until(lambda: False), strict=False):
        assert shot.number == expected
        times.append(shot.time_s)
        time.sleep(0.02)
    assert np.diff(times).min() > 0
    assert len(times) + incoming.dropped == 200
    assert incoming.dropped > 50
    assert times[-1] == 0.199


def test_a_source_that_gives_nothing_reaches_who_waits():
    def camera():
        raise InputError("bad-value", "The camera is gone.")
        yield

    with pytest.raises(InputError, match="gone"):
        list(Incoming(Source("camera", camera(), None, waits=False)).until(lambda: False))


def test_a_camera_that_is_pulled_out_ends_the_take_and_it_is_processed(
    numbered_film, toy_detector, tmp_path, monkeypatch, capsys
):
    def camera():
        yield from open_source(str(numbered_film)).shots
        raise InputError("bad-value", "The camera is gone.")

    came = Source("camera", camera(), None, waits=True)
    monkeypatch.setattr("pcnet3d.stages.study.live.command.open_source", lambda *_: came)
    live(source="0", output=tmp_path / "out", detector=str(toy_detector), settings=QUICK)
    assert "warning: The camera is gone. What came before is kept." in capsys.readouterr().err
    frames, _ = logged(tmp_path / "out" / "live.rrd", "body/joints", "Points3D:positions")
    assert frames.tolist() == list(range(60))
    with np.load(tmp_path / "out" / "poses.npz") as poses:
        assert poses["frame_index"].tolist() == list(range(60))


def test_a_pipe_whose_time_starts_again_ends_the_take_and_it_is_processed(
    numbered_film, toy_detector, tmp_path
):
    """It once threw the recording away."""
    output = tmp_path / "out"
    command = ["live", "-", "-o", str(output), "--detector", str(toy_detector), "--set", *GEOMETRIC]
    (tmp_path / "twice.ts").write_bytes(numbered_film.read_bytes() * 2)
    with (tmp_path / "twice.ts").open("rb") as twice:
        ended = subprocess.run([*APART, *command], stdin=twice, capture_output=True)
    assert ended.returncode == 0, ended.stderr
    said = " ".join(ended.stderr.decode().split())
    assert "each image later than the one before" in said
    assert "What came before is kept." in said
    assert {"live.rrd", "video.ts", "keypoints.npz"} <= {path.name for path in output.iterdir()}
    with np.load(output / "poses.npz") as poses:
        assert poses["frame_index"].tolist() == list(range(60))


def test_images_without_a_time_come_at_the_streams_rate_and_none_may_stand_still(monkeypatch):
    image = SimpleNamespace(rotation=0, to_ndarray=lambda **_: np.zeros((2, 2, 3), np.uint8))
    images = [SimpleNamespace(time=time_s, **vars(image)) for time_s in (5.0, None, 5.1, 5.1)]
    stream = SimpleNamespace(average_rate=25, codec_context=SimpleNamespace())
    container = SimpleNamespace(streams=SimpleNamespace(video=[stream]), decode=lambda _: iter(images))
    monkeypatch.setattr("av.open", lambda *_, **__: nullcontext(container))
    shots = open_source("rtsp://somewhere").shots
    np.testing.assert_allclose([next(shots).time_s for _ in range(3)], [0, 0.04, 0.1])
    with pytest.raises(InputError, match=r"at 5\.100 s after one at 5\.100 s"):
        next(shots)


@pytest.mark.parametrize(
    ("source", "words"),
    [("file:///etc/passwd", "by its path"), ("nothing.mp4", "found nothing"), ("99", "no camera 99")],
)
def test_sources_that_are_none(source, words):
    with pytest.raises(InputError, match=words):
        next(open_source(source).shots)


def test_a_pipe_that_is_no_video(toy_detector, tmp_path):
    command = ["live", "-", "-o", str(tmp_path / "out"), "--detector", str(toy_detector)]
    ended = subprocess.run([*APART, *command], input=b"no video" * 999, capture_output=True)
    assert ended.returncode == 2
    assert b"the pipe" in ended.stderr
    assert not any(tmp_path.iterdir())


def test_live_ends_before_the_disk_is_full_and_keeps_what_it_has(
    numbered_film, toy_detector, tmp_path, monkeypatch
):
    """The recording was once lost."""
    free = iter([10**9] * 21)
    monkeypatch.setattr(
        shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 0, next(free, 1000))
    )
    with pytest.raises(InputError) as refused:
        live(
            source=str(numbered_film),
            output=tmp_path / "out",
            detector=str(toy_detector),
            settings=[*GEOMETRIC],
        )
    assert refused.value.code == "cannot-write"
    frames, _ = logged(tmp_path / "out" / "live.rrd", "source/joints", "Points3D:positions")
    assert 0 < len(frames) < 60
    assert load_detections(tmp_path / "out" / "keypoints.npz").frames_seen == len(frames)


def test_a_disk_that_is_full_is_told_before_anything_is_recorded(
    numbered_film, toy_detector, tmp_path, monkeypatch
):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 0, 1000))
    with pytest.raises(InputError) as refused:
        live(source=str(numbered_film), output=tmp_path / "out", detector=str(toy_detector))
    assert refused.value.code == "cannot-write"
    assert not (tmp_path / "out").exists()
