"""Sources of live: files, pipes and cameras that break, are too fast or give nothing, and a disk that becomes full."""

from __future__ import annotations

import shutil
import signal
import subprocess
import threading
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np
import pytest

from commands import APART
from golden.live import GEOMETRIC, QUICK, frames_of, logged
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.detections import load_detections
from pcnet3d.stages.study.live.command import live
from pcnet3d.stages.study.live.source import Incoming, Shot, Source, open_source
from refusals import refused


def test_a_file_in_the_place_of_a_pipe_loses_no_frame_and_its_video_is_kept(
    numbered_film, toy_detector, tmp_path
):
    output = tmp_path / "out"
    command = ["live", "-", "-o", str(output), "--detector", str(toy_detector), "--set", *GEOMETRIC]
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
    command += ["--json", "--set", *GEOMETRIC]
    pipe = subprocess.PIPE
    with subprocess.Popen([*APART, *command], stdin=pipe, stdout=pipe, stderr=pipe) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(numbered_film.read_bytes())  # and no end, as of a camera
        process.stdin.flush()
        assert process.stdout.readline()  # the first image is done
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate()
    assert process.returncode == 0, errors
    frames, _ = logged(output / "live.rrd", "body/joints", "Points3D:positions")
    assert len(frames) > 0  # how many is how fast the machine is
    names = {path.name for path in output.iterdir()}
    assert {"live.rrd", "take.rrd", "keypoints.npz"} <= names
    assert "video.ts" not in names
    assert logged(output / "live.rrd", "video", "VideoStream:sample")[1] == []


def test_of_a_camera_that_is_too_fast_only_the_newest_image_is_taken():
    """Twenty more come while one is looked at."""
    looked_at, came = threading.Semaphore(0), threading.Semaphore(0)

    def camera():
        for number in range(201):
            if number % 20 == 1:
                came.release()
                looked_at.acquire()
            yield Shot(number, number / 1000, np.zeros((2, 2, 3), np.uint8))
        came.release(2)  # the last is looked at too

    incoming = Incoming(Source("camera", camera(), None, waits=False))
    numbers, times = [], []
    for shot in incoming.until(lambda: False):
        numbers.append(shot.number)
        times.append(shot.time_s)
        if shot.number == 0:
            came.acquire()
        looked_at.release()
        came.acquire()
    assert numbers == list(range(11))
    assert times == [number / 1000 for number in range(0, 201, 20)]
    assert incoming.dropped == 190


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
    assert frames_of(tmp_path / "out") == list(range(60))


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
    assert frames_of(output) == list(range(60))


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
    out, detector = tmp_path / "out", str(toy_detector)
    with refused("cannot-write"):
        live(source=str(numbered_film), output=out, detector=detector, settings=[*GEOMETRIC])
    frames, _ = logged(tmp_path / "out" / "live.rrd", "source/joints", "Points3D:positions")
    assert 0 < len(frames) < 60
    assert load_detections(tmp_path / "out" / "keypoints.npz").frames_seen == len(frames)


def test_a_disk_that_is_full_is_told_before_anything_is_recorded(
    numbered_film, toy_detector, tmp_path, monkeypatch
):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 0, 1000))
    with refused("cannot-write"):
        live(source=str(numbered_film), output=tmp_path / "out", detector=str(toy_detector))
    assert not (tmp_path / "out").exists()
