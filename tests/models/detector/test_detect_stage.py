"""The stage `detect`: whose keypoints are taken, who is said to be whom, and detectors that answer nonsense."""

from dataclasses import replace

import numpy as np
import pytest

from golden.detections import AS_COCO
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.detector.protocols import Found
from pcnet3d.pipeline import InputError, Take
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.run import run_people
from pcnet3d.stages.detect import Detect
from refusals import refused


class _Two:
    """A detector that sees two people, one of them from frame 5 on, the smaller one first."""

    method, layout = "two@0", COCO17

    def __init__(self) -> None:
        self._frame = -1

    def people(self, image, before=()):
        self._frame += 1
        rng = np.random.default_rng(0)
        near = Found(200 + 60 * rng.random((17, 2)), np.full(17, 0.9), np.array([200, 200, 260, 260]))
        far = Found(50 + 20 * rng.random((17, 2)), np.full(17, 0.9), np.array([50, 50, 70, 70]))
        return (far, near) if self._frame >= 5 else (far,)


def test_the_longest_track_is_taken_unless_another_is_named(walk_film, monkeypatch):
    monkeypatch.setattr("pcnet3d.stages.detect.load_detector", lambda *_: _Two())
    take = Take("walk", video=walk_film)
    default = Detect()(take)
    assert default.keypoints.person == "0"
    chosen = default.notices[0]
    assert (chosen.code, chosen.values["listed"]) == ("person-chosen", "1 (frames 5 to 39)")
    assert not any(each.code == "others-missed" for each in default.notices)
    assert not any(each.code == "lost-and-found" for each in default.notices)
    assert not any(each.code == "interrupted" for each in default.notices)
    named = Detect()(take.telling(person="1"))
    assert (named.keypoints.person, len(named.keypoints)) == ("1", 35)
    assert not any(each.code == "person-chosen" for each in named.notices)
    with pytest.raises(InputError, match="no person '7'"):
        Detect()(take.telling(person="7"))


def test_everybody_of_a_plain_video_gets_a_run(walk_film, quick, monkeypatch, tmp_path):
    """There was one run a video; the rest needed a network's name, a second command and a file of the first."""
    walk = walker(seconds=2)
    points = side_camera(walk).project(walk.world)[:, AS_COCO]
    asked = []

    class Walkers(_Two):
        def people(self, image, before=()):
            self._frame += 1
            own = [0.4 * points[self._frame] + [x, 0] for x in (0, 40)]
            boxes = [np.array([*each.min(axis=0), *each.max(axis=0)]) for each in own]
            return tuple(Found(xy, np.full(17, 0.9), box) for xy, box in zip(own, boxes, strict=True))

    monkeypatch.setattr(
        "pcnet3d.stages.detect.load_detector", lambda *given: asked.extend(given[3:4]) or Walkers()
    )
    options = RunOptions(video=walk_film.path, recipe=quick)
    runs = run_people(options, tmp_path / "out")
    assert asked == [True]
    assert [(run.folder, run.frames) for run in runs] == [("0", 40), ("1", 40)]
    assert not any("person-chosen" in [each.code for each in run.take.notices] for run in runs)
    kept = {path.name for path in (tmp_path / "out").iterdir()}
    assert kept == {"0", "1", "keypoints.npz", "summary.json"}
    assert not any(path.name.startswith(".") for path in tmp_path.iterdir())
    with refused("option-conflict", "--person 0"):
        run_people(options.with_(person="0"), tmp_path / "other")


@pytest.mark.parametrize(("found_in", "again"), [(2, False), (32, True)])
def test_who_is_lost_and_found_again_is_one_person(walk_film, monkeypatch, found_in, again):
    """One network looks at one person at a time: a man lost for a somersault came back as the third of two people. The
    second was a woman far from him in the very next image, whom he "may be"."""

    class Lost(_Two):
        def people(self, image, before=()):
            frame = self._frame + 1
            self._frame = 4
            far, _ = super().people(image, before)
            self._frame = frame
            there = replace(far, xy=far.xy + 100, box=far.box + 100)
            return (far,) if frame < 2 else (there,) * (frame >= found_in)

    monkeypatch.setattr("pcnet3d.stages.detect.load_detector", lambda *_: Lost())
    video = Take("walk", video=walk_film)
    take = Detect()(video)
    codes = [each.code for each in take.notices]
    assert ("person-chosen" in codes, "joined-again" in codes) == (not again, again)
    assert (take.keypoints.frame_index[0] < 2) == again


def test_a_detector_that_goes_on_with_somebody_else_gives_two_people(walk_film, monkeypatch):
    """A man went behind a woman, and his track went on with her: an arm was raised that was hers."""

    class Crossing(_Two):
        def people(self, image, before=()):
            self._frame = max(self._frame, 4)
            man = super().people(image, before)[-1]
            return (
                (man,) if self._frame < 15 else (replace(man, xy=20 + 0.6 * man.xy, box=20 + 0.6 * man.box),)
            )

    monkeypatch.setattr("pcnet3d.stages.detect.load_detector", lambda *_: Crossing())
    said = {each.code: each.values for each in Detect()(Take("walk", video=walk_film)).notices}
    assert said["person-chosen"]["listed"] == "0 (frames 0 to 9)"
    assert said["cut-or-another"]["frame"] == 10


def test_a_rate_that_contradicts_the_video_is_said_once(walk_film, monkeypatch):
    monkeypatch.setattr("pcnet3d.stages.detect.load_detector", lambda *_: _Two())
    take = Detect()(Take("walk", video=walk_film).telling(fps=2 * walk_film.fps))
    said = [each.code for each in (*take.notices, *take.keypoints.notices)]
    assert said.count("fps-contradicts") == 1
    np.testing.assert_allclose(take.keypoints.times, np.arange(40) / (2 * walk_film.fps), atol=1e-9)


def test_of_two_who_are_seen_throughout_the_longest_is_the_larger(walk_film, monkeypatch):
    """They were refused, after all images had been looked at."""

    class Both(_Two):
        def people(self, image, before=()):
            self._frame = 5
            return super().people(image, before)

    monkeypatch.setattr("pcnet3d.stages.detect.load_detector", lambda *_: Both())
    take = Take("walk", video=walk_film)
    found = [Detect()(take.telling(person=asked)).keypoints for asked in (None, "longest")]
    assert [len(one) for one in found] == [40, 40]
    assert all(np.nanmin(one.joints) >= 200 for one in found)


@pytest.mark.parametrize(
    "given",
    [
        None,
        np.zeros((17, 3)),
        (np.zeros((17, 3)),),
        (Found(np.zeros((5, 2)), np.ones(5), np.zeros(4)),),
        (Found(np.zeros((17, 2)), np.ones(17), np.zeros(2)),),
    ],
)
def test_a_detector_of_another_package_that_gives_no_people_is_refused(walk_film, monkeypatch, given):
    class Broken(_Two):
        def people(self, image, before=()):
            return given

    monkeypatch.setattr("pcnet3d.stages.detect.load_detector", lambda *_: Broken())
    with pytest.raises(InputError, match=r"from the detector two@0 .* repair its package"):
        Detect()(Take("walk", video=walk_film))
