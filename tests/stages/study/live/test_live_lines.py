"""Poses that live prints as lines of JSON, and the generator in Python; readers that are gone or slow."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import replace

import numpy as np
import pytest

from commands import APART
from golden.recordings import GEOMETRIC
from pcnet3d.pipeline import H36M17, rotate
from pcnet3d.pipeline.files.detections import load_detections
from pcnet3d.stages import LivePose, live_frames
from pcnet3d.stages.study.live import frames
from pcnet3d.stages.study.live.command import live
from pcnet3d.stages.study.live.frames import Source
from refusals import refused


@pytest.fixture(scope="module")
def poses(numbered_film, toy_detector) -> list[LivePose]:
    return list(live_frames(numbered_film, toy_detector, rectifier="geometric"))


def test_every_frame_of_a_file_has_its_pose(poses):
    assert [pose.frame for pose in poses] == list(range(60))
    assert {pose.dropped for pose in poses} == {0}
    for pose in poses[1:]:
        in_camera = rotate(pose.R_camera_from_body, pose.body)
        np.testing.assert_allclose(rotate(pose.R_camera_from_level, pose.level), in_camera, atol=1e-6)
        np.testing.assert_allclose(pose.R_camera_from_level[:, 2], pose.up, atol=1e-6)
        np.testing.assert_allclose(pose.R_camera_from_body[:, 2], pose.up, atol=1e-6)
        np.testing.assert_allclose(pose.body[:, 2], pose.level[:, 2], atol=1e-6)  # one up
    assert all(0 < pose.latency_ms < np.inf for pose in poses)
    assert all(abs(pose.captured_s - time.time()) < 600 for pose in poses)


def test_what_is_missing_is_null_in_json(poses):
    nobody = replace(poses[5], person=None, body=np.full((17, 3), np.nan), error_deg=float("nan"))
    sent = json.loads(json.dumps(nobody.as_dict(), allow_nan=False))
    assert sent["error_deg"] is None
    assert sent["body"]["r_wrist"] == [None, None, None]
    assert list(sent["level"]) == list(H36M17.joints)


def command(film, toy, folder) -> list[str]:
    settings = ["--set", *GEOMETRIC]
    return [*APART, "live", film, "--detector", toy, "-o", folder, *settings, "--json"]


def test_standard_output_has_a_line_a_frame_and_nothing_else(numbered_film, toy_detector, poses, tmp_path):
    ended = subprocess.run(command(numbered_film, toy_detector, tmp_path / "out"), capture_output=True)
    assert ended.returncode == 0, ended.stderr
    sent = [json.loads(line) for line in ended.stdout.splitlines()]
    assert [each["frame"] for each in sent] == list(range(60))
    np.testing.assert_allclose(
        sent[-1]["body"]["r_wrist"], poses[-1].body[H36M17.index("r_wrist")], atol=1e-3
    )
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())["live"]
    assert (summary["frames"], summary["dropped"]) == (60, 0)
    assert 0 < summary["latency_p50_ms"] <= summary["latency_p95_ms"]


def test_a_reader_that_ends_leaves_the_recording_whole(numbered_film, toy_detector, tmp_path):
    output = tmp_path / "out"
    with subprocess.Popen(
        command(numbered_film, toy_detector, output),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.readline()
        process.stdout.close()
        said = process.stderr.read().decode()
    assert process.returncode == 0, said
    assert "Traceback" not in said
    assert said.count("standard output is closed") == 1
    assert load_detections(output / "keypoints.npz").frame_index.tolist() == list(range(60))


def test_closed_standard_streams_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "stdout", None)
    with refused("not-reached"):
        live(source="0", output=tmp_path / "out", as_json=True)
    assert not any(tmp_path.iterdir())


def test_networks_are_loaded_before_the_first_image(monkeypatch, numbered_film, toy_detector):
    """Or images would be left out while they load."""
    order, loads, looks = [], frames.Watch.for_camera, Source.until

    def for_camera(watch, image_size):
        order.append("networks")
        return loads(watch, image_size)

    def until(source, stop):
        order.append("images")
        return looks(source, stop)

    monkeypatch.setattr(frames.Watch, "for_camera", for_camera)
    monkeypatch.setattr(Source, "until", until)
    next(live_frames(numbered_film, toy_detector, rectifier="geometric"))
    assert order[:2] == ["networks", "images"]
