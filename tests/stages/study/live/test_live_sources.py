"""Sources of live: cameras that break, are too fast or give nothing, and a disk that becomes full."""

from __future__ import annotations

import os
import shutil
import signal
import threading
from itertools import count

import numpy as np
import pytest

from golden.recordings import GEOMETRIC, kept
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.detections import load_detections
from pcnet3d.stages.study.live.command import live
from pcnet3d.stages.study.live.frames import Shot, Source, open_source
from refusals import refused


def keypoints_of(folder):
    return load_detections(folder / "keypoints.npz")


def test_ctrl_c_ends_the_take_and_what_came_is_kept(camera, toy_detector, tmp_path):
    images = count()

    def pressed(image):
        if next(images) == 20:
            os.kill(os.getpid(), signal.SIGINT)
        return image

    camera(pressed)
    told = {"detector": str(toy_detector), "settings": GEOMETRIC, "no_frames": True}
    live(source="0", output=tmp_path / "out", **told)
    frames = keypoints_of(tmp_path / "out").frame_index.tolist()
    assert 0 < len(frames) < 60
    assert frames == list(range(len(frames)))
    assert kept(tmp_path / "out", images=0)


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

    source = Source("camera", camera(), None, waits=False)
    numbers, times = [], []
    for shot in source.until(lambda: False):
        numbers.append(shot.number)
        times.append(shot.time_s)
        if shot.number == 0:
            came.acquire()
        looked_at.release()
        came.acquire()
    assert numbers == list(range(11))
    assert times == [number / 1000 for number in range(0, 201, 20)]
    assert source.dropped == 190


def test_a_camera_that_is_pulled_out_ends_the_take_and_what_came_is_kept(
    numbered_film, toy_detector, tmp_path, monkeypatch, capsys
):
    def camera():
        yield from open_source(str(numbered_film)).shots
        raise InputError("bad-value", "The camera is gone.")

    came = Source("camera", camera(), None, waits=True)
    monkeypatch.setattr("pcnet3d.stages.study.live.command.open_source", lambda *_: came)
    live(source="0", output=tmp_path / "out", detector=str(toy_detector), settings=GEOMETRIC)
    assert "warning: The camera is gone. What came before is kept." in capsys.readouterr().err
    assert keypoints_of(tmp_path / "out").frame_index.tolist() == list(range(60))
    assert kept(tmp_path / "out")


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("rtsp://camera", "no address"),
        ("-", "no pipe"),
        ("nothing.mp4", "found nothing"),
        ("99", "no camera 99"),
    ],
)
def test_sources_that_are_none(source, words):
    with pytest.raises(InputError, match=words):
        next(open_source(source).shots)


@pytest.mark.parametrize("looks", [0, 21])
def test_live_ends_before_the_disk_is_full_and_keeps_what_it_has(
    numbered_film, toy_detector, tmp_path, monkeypatch, looks
):
    """The recording was once lost. looks: at the free space, in which there is some."""
    free = iter([10**9] * looks)
    monkeypatch.setattr(
        shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 0, next(free, 1000))
    )
    out, detector = tmp_path / "out", str(toy_detector)
    with refused("cannot-write"):
        live(source=str(numbered_film), output=out, detector=detector, settings=GEOMETRIC)
    if not looks:
        assert not out.exists()
        return
    assert 0 < keypoints_of(out).frames_seen < 60
