"""`pcnet3d live` on a file and on a pipe: what it knew at the time, and how it ends."""

from __future__ import annotations

import json
import shlex
from itertools import count
from pathlib import Path
from types import SimpleNamespace

import av
import numpy as np
import pytest

from commands import pcnet3d, succeeded
from golden import numbered
from golden.recordings import GEOMETRIC, kept
from pcnet3d.adapters import read_all
from pcnet3d.models import Found
from pcnet3d.models.lifter.builtin import LiveLifter
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.stages.study.live.command import live


@pytest.fixture(scope="module")
def from_file(numbered_film, toy_detector, tmp_path_factory):
    output = tmp_path_factory.mktemp("live") / "out"
    live(source=str(numbered_film), output=output, detector=str(toy_detector), settings=GEOMETRIC)
    return output


def test_images_are_there_as_they_were_shown(camera, toy_detector, tmp_path):
    live(source="0", output=tmp_path / "out", detector=str(toy_detector), settings=GEOMETRIC)
    with av.open(str(tmp_path / "out" / "video.ts")) as video:
        corners = [image.to_ndarray(format="gray")[8:40, 8:40].mean() for image in video.decode(video=0)]
    np.testing.assert_allclose(corners, 8 + 4 * np.arange(60), atol=3)


def test_what_is_recorded_is_for_run(from_file, joints_px):
    made = {path.name for path in from_file.iterdir()}
    assert made == {"keypoints.npz", "summary.json"}  # no video: the file itself is there
    (person,) = read_all(from_file / "keypoints.npz")
    np.testing.assert_allclose(person.joints, joints_px, atol=0.01)
    summary = json.loads((from_file / "summary.json").read_text())
    assert {"toy.onnx", "lifter.onnx"} <= summary["device"]["networks"].keys()
    assert summary["live"]["frames"] == 60


@pytest.mark.parametrize("no_frames", [False, True])
def test_the_command_that_live_prints_processes_the_recording(
    camera, toy_detector, tmp_path, capsys, no_frames, monkeypatch
):
    """Of a camera with odd sides, whose video has even ones."""
    camera(lambda image: image[:-1, :-1])
    monkeypatch.chdir(tmp_path)
    live(source="0", output=Path("out"), detector=str(toy_detector), settings=GEOMETRIC, no_frames=no_frames)
    (line,) = [line for line in capsys.readouterr().out.splitlines() if "pcnet3d run" in line]
    program, *words = shlex.split(line[line.index("pcnet3d run") :])
    assert program == "pcnet3d"
    succeeded(pcnet3d(*words, "--set", "report=off", "--set", "record=off", cwd=tmp_path))
    assert (tmp_path / "results" / "poses.npz").exists()


def test_a_gravity_that_is_told_is_believed_from_the_first_frame_on(
    numbered_film, toy_detector, tmp_path, capfdbinary
):
    for gravity, bounded in (([], False), (["read.gravity=-0.3,0.95,-0.1"], True)):
        settings = [*GEOMETRIC, *gravity]
        output, toy = tmp_path / str(bounded), str(toy_detector)
        live(source=str(numbered_film), output=output, detector=toy, settings=settings, as_json=True)
        bounds = [json.loads(line)["up_bound_deg"] for line in capfdbinary.readouterr().out.splitlines()]
        assert [bound < 2 for bound in bounds if bound is not None] == [bounded] * 60


@pytest.mark.parametrize(
    "setting",
    [
        "detect=off",
        "detect.looks=0",
        "detect.everybody=true",
        "export.also=trc",
        "read.title=Walk",
        "read.gravity=0,0,0",
        "rectify.rectifier=nothing",
    ],
)
def test_a_setting_that_live_cannot_use_is_refused_before_anything_is_recorded(camera, tmp_path, setting):
    camera(pytest.fail)  # which must not be looked at
    with pytest.raises(InputError):
        live(source="0", output=tmp_path / "out", settings=[setting])
    assert not any(tmp_path.iterdir())


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
    live(source=str(numbered_film), output=tmp_path / "out", settings=GEOMETRIC)
    first, second = filter(None, seen)  # the first that is made only loads the network
    assert len(first) == 51
    np.testing.assert_allclose(second, moved[:9].max(axis=(1, 2)), rtol=1e-5)
    assert "--person 0" in capsys.readouterr().out  # who was shown most


@pytest.mark.parametrize("no_frames", [False, True])
def test_a_video_in_which_nobody_was_found_is_kept_too(camera, tmp_path, no_frames):
    toy = numbered.toy_detector(tmp_path / "toy.onnx", score=0.0)
    told = {"detector": str(toy), "settings": GEOMETRIC, "no_frames": no_frames}
    with pytest.raises(InputError, match="Nobody was found in 60 frames of camera"):
        live(source="0", output=tmp_path / "out", **told)
    assert kept(tmp_path / "out", images=0 if no_frames else 60)
