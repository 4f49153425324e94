"""Detection over whole videos: where the person is, cuts, gaps, odd files, interrupted and taken up again; and the
stage `detect`: whose keypoints are taken, and detectors that answer nonsense."""

import json
from collections.abc import Callable
from dataclasses import fields, replace

import av
import numpy as np
import pytest

from golden.detections import AS_COCO, detected, scored
from golden.films import pressing_ctrl_c
from pcnet3d.adapters.keypoints import read as read_keypoints
from pcnet3d.adapters.video import read as read_video
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.models.detector import video as detect_video
from pcnet3d.models.detector.load import load_detector
from pcnet3d.models.detector.protocols import Found
from pcnet3d.models.detector.video import detect
from pcnet3d.pipeline import InputError, Take
from pcnet3d.pipeline.core.device import placement
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.pipeline.core.messages import how_many
from pcnet3d.pipeline.files import video_frames
from pcnet3d.pipeline.files.detections import Detections, load_detections
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.reading.take import open_take
from pcnet3d.pipeline.running.run import run_people
from pcnet3d.stages.detect import Detect
from refusals import refused


def same(a: Detections, b: Detections) -> bool:
    pairs = ((getattr(a, one.name), getattr(b, one.name)) for one in fields(Detections))
    return all(np.array_equal(one, other, equal_nan=not isinstance(one, str)) for one, other in pairs)


def off(found: Detections, toys, boxes) -> float:
    """Most pixels between what was found and what was drawn."""
    drawn = np.stack([toys.joints_of(boxes[frame]) for frame in found.frame_index])
    return float(np.abs(found.joints - drawn).max())


@pytest.fixture(scope="module")
def eventful(toys, tmp_path_factory):
    """Someone, a gap, a cut, nobody for long, someone again: 70 frames."""
    boxes = toys.walking(70)
    shown = [None if 10 <= i < 14 or 30 <= i < 40 else box for i, box in enumerate(boxes)]
    film = toys.film_in(tmp_path_factory.mktemp("eventful"))
    return film([toys.scene(box, seed=int(i >= 22), size=(360, 240)) for i, box in enumerate(shown)])


@pytest.fixture(scope="module")
def whole(eventful, toy):
    return detect(eventful, load_detector(toy), "here")


def test_a_person_of_whom_the_detector_is_hardly_sure_is_named(walk_film, toy, tmp_path):
    """A tree that MoveNet follows has such scores in every frame; a person has them for moments. It is said of a run's
    keypoints.npz too, which `--person all` and `live` rest on; nobody has measured the scores of other networks."""
    found = detect(walk_film, load_detector(toy))
    for low, named in ((1.0, True), (0.3, False)):
        score = found.confidence.copy()
        score[: round(low * len(score))] = 0.4
        for method, known in ((found.method, True), ("simcc@0", False)):
            told = replace(found, confidence=score, method=method)
            said = tuple(told.doubts(*told.people()))
            assert [each.code for each in said] == ["hardly-a-person"] * (named and known)
            told.save(tmp_path / "keypoints.npz")
            (person,) = read_keypoints(tmp_path / "keypoints.npz")
            assert person.notices == said


@pytest.mark.parametrize(("frames", "of", "method", "few"), [
    (1, 237, "movenet@0", True), (9, 237, "movenet@0", True), (10, 237, "movenet@0", False),
    (1, 1, "movenet@0", False), (1, 237, "simcc@0", False),
])  # fmt: skip
def test_who_is_found_in_few_images_is_said_to_lack_shoulders_or_hips(frames, of, method, few):
    """A head and shoulders at a desk were a person in 1 of 237 frames, and nothing said why."""
    found = detected(np.arange(frames), scored(np.zeros((frames, 17, 2))), np.zeros(frames, int))
    change = np.r_[np.nan, np.zeros(of - 1)]
    told = replace(found, method=method, frames=of, frames_seen=of, change=change)
    said = [each.text for each in told.doubts(*told.people())]
    assert [f"found in {how_many(frames, 'frame')} only" in text for text in said] == [True] * few


@pytest.mark.parametrize(("score", "people"), [(0.1, 1), (0.8, 2)])
def test_legs_that_nobody_sees_make_no_second_person(score, people):
    """Of a woman to the hips the legs were guessed near her, then far below: one person was three."""
    body = np.random.default_rng(0).uniform(0, 100, (17, 2))
    xy = np.tile(body, (40, 1, 1))
    xy[20:, COCO17.indices(("l_knee", "r_knee", "l_ankle", "r_ankle"))] += [0, 150]
    found = detected(np.arange(40), scored(xy), np.zeros(40, int))
    confidence = np.full((40, 17), 0.8)
    confidence[:, COCO17.indices(("l_knee", "r_knee", "l_ankle", "r_ankle"))] = score
    told = detect_video._told_apart(replace(found, confidence=confidence))
    assert len(told.people()) == people


def test_of_a_part_only_its_frames_are_decoded(walk_film, toys, toy, monkeypatch):
    shown = []
    turned = video_frames._upright

    def noting(frame, rotation_deg):
        shown.append(frame.pts)
        return turned(frame, rotation_deg)

    monkeypatch.setattr(video_frames, "_upright", noting)
    found = detect(replace(walk_film, part=(15, 29)), load_detector(toy))
    assert len(shown) == 15
    assert found.frame_index.tolist() == list(range(15, 30))
    assert off(found, toys, toys.walking(40)) < 1.5
    np.testing.assert_array_equal(found.time_s, walk_film.time_s[15:30])
    assert found.frames_seen == found.frames
    part = detect(replace(walk_film, part=(31, 39)), load_detector(toy))
    assert not part.doubts(*part.people())  # the 9 frames of the part were few of the 40 of the video


def test_gaps_are_bridged_and_nobody_is_followed_over_a_cut(whole):
    assert whole.cuts.tolist() == [22]
    assert [
        (one.person, int(one.frame_index[0]), int(one.frame_index[-1]), len(one)) for one in whole.people()
    ] == [("0", 0, 21, 18), ("1", 22, 69, 38)]


@pytest.mark.parametrize("stop", [0, 11, 21, 22, 33, 69])
def test_interrupted_and_resumed_is_bitwise_the_same(eventful, whole, toy, tmp_path, monkeypatch, stop):
    with monkeypatch.context() as patched:
        patched.setattr(detect_video, "images_ahead", pressing_ctrl_c(detect_video.images_ahead, stop))
        part = detect(eventful, load_detector(toy), "here")
    assert part.frames_seen == stop + 1
    assert part.frame_index.max() <= stop
    part.save(tmp_path / "part.npz")
    resumed = detect(eventful, load_detector(toy), "here", load_detections(tmp_path / "part.npz"))
    assert same(resumed, whole)


class _Counting:
    """A detector and the images that it looked at."""

    def __init__(self, detector) -> None:
        self._detector, self.looks = detector, 0
        self.method, self.layout = detector.method, detector.layout

    def people(self, image, before=()):
        self.looks += 1
        return self._detector.people(image, before)


@pytest.mark.parametrize("nobody", [29, 62])
def test_who_comes_where_nobody_was_for_long_is_seen_a_little_later(
    film, toys, toy, tmp_path, monkeypatch, nobody
):
    """Every image of an empty room was searched with all looks, at a tenth of the usual speed."""
    boxes = toys.walking(80)
    shown = [None if 8 <= i < 8 + nobody else box for i, box in enumerate(boxes)]
    empty = film([toys.scene(box, size=(360, 240)) for box in shown])
    counting = _Counting(load_detector(toy))
    whole = detect(empty, counting, "here")
    found = whole.frame_index[whole.frame_index >= 8]
    if nobody < 30:
        assert (counting.looks, found[0]) == (80, 8 + nobody)
        return
    assert 0 <= whole.time_s[8] - empty.time_s[8 + nobody] < 0.2
    np.testing.assert_array_equal(found, np.arange(found[0], 80))
    assert counting.looks == 8 + 30 + len(range(36, nobody, 6)) + len(found)
    for stop in (20, 50, 69):
        with monkeypatch.context() as patched:
            patched.setattr(detect_video, "images_ahead", pressing_ctrl_c(detect_video.images_ahead, stop))
            detect(empty, load_detector(toy), "here", keep=lambda found: found.save(tmp_path / "part.npz"))
        part = load_detections(tmp_path / "part.npz")
        assert part.frames_seen == stop + 1
        assert same(detect(empty, load_detector(toy), "here", part), whole)


@pytest.mark.parametrize(
    ("lit", "dark", "part"), [(15, 5, None), (15, 45, None), (15, 45, (20, 69)), (0, 45, None)]
)
def test_a_cut_over_black_is_noticed_after_an_interruption_in_the_black(
    film, toys, toy, monkeypatch, lit, dark, part
):
    """However long it was dark: the 30 images before the interruption were looked at alone."""
    cut = lit + dark
    shown = [toys.scene(box, seed=int(i >= cut)) for i, box in enumerate(toys.walking(cut + 10))]
    video = film(shown[:lit] + [np.zeros_like(shown[0])] * dark + shown[cut:])
    video = replace(video, part=part)
    with monkeypatch.context() as patched:
        patched.setattr(detect_video, "images_ahead", pressing_ctrl_c(detect_video.images_ahead, cut - 1))
        stopped = detect(video, load_detector(toy))
    assert stopped.frames_seen == cut
    resumed = detect(video, load_detector(toy), resume=stopped)
    assert resumed.cuts.tolist() == [cut] * (lit > 0 and part is None)
    assert same(resumed, detect(video, load_detector(toy)))


def test_damage_is_said_and_kept(film, toys, toy, tmp_path):
    """Zeros in a stream, which decoders bridge by images of their own: a run went through without a word."""
    shown = film([toys.scene(box) for box in toys.walking(40)], name="film.ts")
    with av.open(shown.path) as container:
        places = [packet.pos for packet in container.demux(video=0) if packet.size]
    content, start = bytearray(shown.path.read_bytes()), places[20] + 188  # its stamp stays
    content[start : places[21]] = bytes(places[21] - start)
    shown.path.write_bytes(content)
    (shown,) = read_video(shown.path)
    found = detect(shown, load_detector(toy), "here")
    assert 10 < found.damaged.min() < 30
    found.save(tmp_path / "keypoints.npz")
    assert same(load_detections(tmp_path / "keypoints.npz"), found)
    again = open_take(RunOptions(video=shown.path, keypoints=tmp_path / "keypoints.npz"))
    for take in (Detect(detector=str(toy))(Take("walk", video=shown)), again):
        (text,) = (event.text for event in take.notices if "damaged" in event.text)
        assert f"damaged at frame {found.damaged[0]}" in text


def test_a_video_of_which_no_image_can_be_decoded_is_not_one_without_people(walk_film, toy, monkeypatch):
    monkeypatch.setattr(detect_video, "images_ahead", lambda *_: iter(()))
    with pytest.raises(InputError, match="not one of its 40 frames can be decoded"):
        detect(walk_film, load_detector(toy))


@pytest.mark.parametrize(("size", "frames"), [((321, 241), 3), ((64, 200), 3), ((33, 31), 1)])
def test_odd_sizes_and_a_single_frame(film, toys, toy, size, frames):
    box = (0.3 * size[0], 0.2 * size[1], 0.6 * size[0], 0.9 * size[1])
    box = tuple(float(round(side)) for side in box)
    found = detect(film([toys.scene(box, size=size)] * frames), load_detector(toy))
    assert len(found.people()[0]) == frames
    assert off(found, toys, [box] * frames) < 1.5


def test_uneven_time_stamps_are_the_videos(film, toys, toy):
    stamps = [0, 10, 70, 80, 200, 210]
    found = detect(film([toys.scene(box) for box in toys.walking(6)], stamps_ms=stamps), load_detector(toy))
    np.testing.assert_allclose(found.people()[0].times, np.array(stamps) / 1000)
    assert off(found, toys, toys.walking(6)) < 1.5


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


@pytest.fixture
def seeing(walk_film, monkeypatch) -> Callable[..., Take]:
    """seeing(class): a take of the film, for whose stage `detect` this is the class of the detector."""

    def see(detector) -> Take:
        monkeypatch.setattr("pcnet3d.stages.detect.load_detector", lambda *_: detector())
        return Take("walk", video=walk_film)

    return see


def test_the_longest_track_is_taken_unless_another_is_named(seeing):
    take = seeing(_Two)
    default = Detect()(take)
    assert default.keypoints.person == "0"
    chosen = default.notices[0]
    assert (chosen.code, chosen.values["listed"]) == ("person-chosen", "1 (frames 5 to 39)")
    assert not any(each.code == "others-missed" for each in default.notices)
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

    def load(*given):
        asked.extend(given[3:4])
        placement().used["walkers.onnx"] = "cpu"
        return Walkers()

    monkeypatch.setattr("pcnet3d.stages.detect.load_detector", load)
    options = RunOptions(video=walk_film.path, recipe=quick, everyone=True)
    runs = run_people(options, tmp_path / "out")
    assert asked == [True]
    assert [(run.folder, run.frames) for run in runs] == [("0", 40), ("1", 40)]
    assert not any("person-chosen" in [each.code for each in run.take.notices] for run in runs)
    kept = {path.name for path in (tmp_path / "out").iterdir()}
    assert kept == {"0", "1", "keypoints.npz", "summary.json"}
    for name in "01":
        device = json.loads((tmp_path / "out" / name / "summary.json").read_text())["device"]
        assert "walkers.onnx" in device["networks"]
    assert not any(path.name.startswith(".") for path in tmp_path.iterdir())
    with refused("option-conflict", "--person is for one person"):
        run_people(options.with_(person="0"), tmp_path / "other")


@pytest.mark.parametrize(("found_in", "again"), [(2, False), (32, True)])
def test_who_is_lost_and_found_again_is_one_person(seeing, found_in, again):
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

    take = Detect()(seeing(Lost))
    codes = [each.code for each in take.notices]
    assert ("person-chosen" in codes, "joined-again" in codes) == (not again, again)
    assert (take.keypoints.frame_index[0] < 2) == again


def test_a_detector_that_goes_on_with_somebody_else_gives_two_people(seeing):
    """A man went behind a woman, and his track went on with her: an arm was raised that was hers."""

    class Crossing(_Two):
        def people(self, image, before=()):
            self._frame = max(self._frame, 4)
            man = super().people(image, before)[-1]
            return (
                (man,) if self._frame < 15 else (replace(man, xy=20 + 0.6 * man.xy, box=20 + 0.6 * man.box),)
            )

    said = {each.code: each.values for each in Detect()(seeing(Crossing)).notices}
    assert said["person-chosen"]["listed"] == "0 (frames 0 to 9)"
    assert said["cut-or-another"]["frame"] == 10


def test_a_rate_that_contradicts_the_video_is_said_once(walk_film, seeing):
    take = Detect()(seeing(_Two).telling(fps=2 * walk_film.fps))
    said = [each.code for each in (*take.notices, *take.keypoints.notices)]
    assert said.count("fps-contradicts") == 1
    np.testing.assert_allclose(take.keypoints.times, np.arange(40) / (2 * walk_film.fps), atol=1e-9)


def test_of_two_who_are_seen_throughout_the_longest_is_the_larger(seeing):
    """They were refused, after all images had been looked at."""

    class Both(_Two):
        def people(self, image, before=()):
            self._frame = 5
            return super().people(image, before)

    take = seeing(Both)
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
def test_a_detector_of_another_package_that_gives_no_people_is_refused(seeing, given):
    class Broken(_Two):
        def people(self, image, before=()):
            return given

    with pytest.raises(InputError, match=r"from the detector two@0 .* repair its package"):
        Detect()(seeing(Broken))
