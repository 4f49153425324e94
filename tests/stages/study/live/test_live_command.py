"""`pcnet3d live` on a file and on a pipe: what it knew at the time, what it makes of the take, and how it ends."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from itertools import count
from types import SimpleNamespace

import numpy as np
import pytest

from golden import numbered
from golden.live import GEOMETRIC, QUICK, frames_of, kept, logged
from pcnet3d.adapters import read_all
from pcnet3d.models import Found
from pcnet3d.models.lifter.live import LiveLifter
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.rotations import unit
from pcnet3d.pipeline.reading.load import read_video
from pcnet3d.pipeline.signals.swaps import kinds
from pcnet3d.stages.detect import Detect
from pcnet3d.stages.study.live.command import live


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
    assert made == {"live.rrd", "keypoints.npz", "summary.json", "take"}  # no video: the file itself is there
    made = {path.name for path in (from_file / "take").iterdir()}
    assert {"take.rrd", "poses.npz", "report.html", "summary.json"} <= made
    (person,) = read_all(from_file / "keypoints.npz")
    np.testing.assert_allclose(person.joints, joints_px, atol=0.01)
    assert frames_of(from_file / "take") == list(range(60))
    summary = json.loads((from_file / "summary.json").read_text())
    assert {"toy.onnx", "lifter.onnx"} <= summary["device"]["networks"].keys()
    assert "take" in summary["files"]


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


@pytest.mark.parametrize(
    ("settings", "no_frames", "why"),
    [
        ("detect=off", False, "got detect=off"),
        ("detect.looks=0", False, "Expected 1 to 4 looks"),
        ("export.also=trc", False, "--stature"),
        ("lift=off", False, "keypoints and its video: Stage 'clean' needs poses"),
        ("read.gravity=0,0,0", False, "direction for gravity"),
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


VALUES = {
    "person_kind": "yolox", "looks": "1", "swaps": "mask", "fps": "60",
    "folder": "there", "checkpoint": "part.npz", "resume": "part.npz", "person": "0", "everybody": "true",
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


def test_exchanged_limbs_are_masked_in_the_run_at_the_end(camera, joints_px, tmp_path):
    wrong = joints_px.copy()
    for way in kinds(COCO17, depth=False):
        wrong[20:30] = way.applied(wrong[20:30])
    settings = [*QUICK, "read.swaps=mask"]
    toy = numbered.toy_detector(tmp_path / "toy.onnx", wrong)
    live(source="0", output=tmp_path / "out", detector=str(toy), settings=settings)
    said = json.loads((tmp_path / "out/take/summary.json").read_text())["notices"]
    (masked,) = [each for each in said if each["code"] == "swaps-masked"]
    assert "frames 20-29" in masked["values"]["swaps"]


def test_images_with_odd_sides_get_their_take(camera, toy_detector, joints_px, tmp_path):
    """The video has even sides, and was once refused for it."""
    camera(lambda image: image[:-1, :-1])
    live(source="0", output=tmp_path / "out", detector=str(toy_detector), settings=QUICK)
    assert read_video(tmp_path / "out" / "video.ts").height == 358
    (person,) = read_all(tmp_path / "out" / "keypoints.npz")
    np.testing.assert_allclose(person.joints, joints_px, atol=1)
    assert frames_of(tmp_path / "out/take") == list(range(60))


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
    first, second = filter(None, seen)  # the first that is made only loads the network
    assert len(first) == 51
    np.testing.assert_allclose(second, moved[:9].max(axis=(1, 2)), rtol=1e-5)
    said = capsys.readouterr().err
    assert "60 frames, latency" in said
    assert "; of 2 people person 0, who was shown most, is taken" in said
    assert "--person" not in said  # there is no such option


@pytest.mark.parametrize(
    "error", [InputError("bad-value", "No."), RuntimeError("a fault"), KeyboardInterrupt()]
)
def test_whatever_fails_behind_the_camera_the_recording_is_kept(
    camera, toy_detector, tmp_path, monkeypatch, error
):
    def fails(*_, **__):
        raise error

    monkeypatch.setattr("pcnet3d.stages.study.live.command.run_files", fails)
    told = {"detector": str(toy_detector), "settings": QUICK}
    with pytest.raises(type(error)):  # a program learns by the exit code that there is no take
        live(source="0", output=tmp_path / "out", **told)
    assert kept(tmp_path / "out")
    assert (tmp_path / "out" / "keypoints.npz").exists()


@pytest.mark.parametrize("no_frames", [False, True])
def test_a_video_in_which_nobody_was_found_is_kept_too(camera, tmp_path, no_frames):
    toy = numbered.toy_detector(tmp_path / "toy.onnx", score=0.0)
    told = {"detector": str(toy), "settings": QUICK, "no_frames": no_frames}
    with pytest.raises(InputError, match="Nobody was found in 60 frames of camera"):
        live(source="0", output=tmp_path / "out", **told)
    assert kept(tmp_path / "out", images=0 if no_frames else 60)
