"""Several looks at one person: known answers of a network that answers as it is told."""

from dataclasses import replace

import numpy as np
import pytest

from pcnet3d.models.detector.crops import Crop
from pcnet3d.models.detector.load import load_detector
from pcnet3d.models.detector.protocols import Found
from pcnet3d.models.detector.topdown import MOST_LOOKS, Follower, SeveralLooks
from pcnet3d.pipeline.core.errors import InputError
from pcnet3d.pipeline.core.layouts import COCO17
from pcnet3d.stages.detect import Detect

WIDTH, HEIGHT = 320, 240
CROP = Crop(60, 20, 200, 200)
R_WRIST, L_WRIST = COCO17.indices(("r_wrist", "l_wrist"))
JOINTS = np.random.default_rng(0).uniform((80, 40), (240, 200), (17, 2)).astype(np.float32)


class Fake:
    """A network that sees JOINTS where they are, by an image whose left column is bright unless it is mirrored; off[i]
    is added to its look number i, in the image's own directions."""

    layout, aspect, room, method = COCO17, 1.0, 1.25, "fake"

    def __init__(self, off=(), sure=0.9, score=(0.8,)):
        self.off, self.sure, self.score, self.crops = list(off), sure, score, []

    def look(self, image, crop):
        mirrored = image[0, 0, 0] == 0
        number = len(self.crops)
        self.crops.append((crop, mirrored))
        xy = JOINTS + (self.off[number] if number < len(self.off) else 0)
        if mirrored:
            xy = np.column_stack([WIDTH - xy[:, 0], xy[:, 1]])[COCO17.mirror]
        return Found(
            xy,
            np.full(17, self.score[min(number, len(self.score) - 1)]),
            np.array([80, 40, 240, 200]),
            self.sure,
        )

    def next_crop(self, found):
        return CROP


@pytest.fixture
def image():
    picture = np.zeros((HEIGHT, WIDTH, 3), np.uint8)
    picture[:, 0] = 255
    return picture


@pytest.mark.parametrize("count", range(2, MOST_LOOKS + 1))
def test_looks_that_agree_change_nothing(image, count):
    fake = Fake()
    found = SeveralLooks(fake, count).look(image, CROP)
    np.testing.assert_allclose(found.xy, JOINTS, atol=1e-3)
    np.testing.assert_allclose(found.score, 0.8, atol=1e-6)
    assert (len(fake.crops), found.sure) == (count, pytest.approx(0.9))
    for crop, mirrored in fake.crops:  # all about the same middle
        middle = crop.left + crop.width / 2
        assert (WIDTH - middle if mirrored else middle) == pytest.approx(160, abs=1)
        assert crop.top + crop.height / 2 == pytest.approx(120, abs=1)
    assert any(mirrored for _, mirrored in fake.crops)
    assert {crop.width for crop, _ in fake.crops} == {200, 176}


def test_small_errors_are_averaged(image):
    found = SeveralLooks(Fake([np.array([4.0, 0]), np.array([-2.0, 2.0])]), 2).look(image, CROP)
    np.testing.assert_allclose(found.xy - JOINTS, np.tile([1.0, 1.0], (17, 1)), atol=1e-3)


def test_a_look_that_contradicts_is_outvoted(image):
    far = np.zeros((17, 2))
    far[R_WRIST] = JOINTS[L_WRIST] - JOINTS[R_WRIST]
    assert np.linalg.norm(far[R_WRIST]) > 20
    found = SeveralLooks(Fake([far]), 4).look(image, CROP)
    np.testing.assert_allclose(found.xy, JOINTS, atol=1e-3)
    assert found.score == pytest.approx(0.8)


def test_of_two_that_contradict_each_other_one_is_taken_never_the_middle(image):
    far = np.zeros((17, 2))
    far[R_WRIST] = (60, 0)
    for scores, expected in (((0.8, 0.7), JOINTS + far), ((0.7, 0.8), JOINTS), ((0.8, 0.8), JOINTS + far)):
        found = SeveralLooks(Fake([far], score=scores), 2).look(image, CROP)
        np.testing.assert_allclose(found.xy, expected, atol=1e-3)  # the surer one, of equals the first
        assert found.score[R_WRIST] == pytest.approx(max(scores))


def test_where_nobody_is_one_look_is_enough(image):
    fake = Fake(sure=0.1)
    assert SeveralLooks(fake, 4).look(image, CROP).sure == pytest.approx(0.1)
    assert len(fake.crops) == 1


def test_a_follower_searches_with_single_looks_and_then_looks_as_often_as_it_is_told(image):
    fake = Fake()
    follower = Follower(fake, 3)
    (found,) = follower.people(image)
    searched = len(fake.crops) - 3
    assert not any(mirrored for _, mirrored in fake.crops[:searched])
    assert [crop.width for crop, _ in fake.crops[searched:]] == [200, 176, 200]
    np.testing.assert_allclose(found.xy, JOINTS, atol=1e-3)
    before = len(fake.crops)
    follower.people(image, [found])
    assert len(fake.crops) == before + 3


@pytest.mark.parametrize("looks", [1, 2])
@pytest.mark.parametrize(("again", "people"), [(0.45, 0), (0.55, 1)])
def test_what_passes_for_a_person_in_one_look_alone_is_nobody(image, looks, again, people):
    """The stem of a tree did in one frame of a hundred, and was followed from there on."""

    class Once(Fake):
        def look(self, image, crop):
            found = super().look(image, crop)
            return replace(found, sure=0.55 if len(self.crops) <= searched else again)

    searched = 12  # three windows, each looked at four times
    assert len(Follower(Once(), looks).people(image)) == people


def test_how_many_looks_a_detector_takes(tmp_path, toys):
    one = toys.save_toy(tmp_path / "toy.onnx", toys.float)
    plain = load_detector(one).method
    assert load_detector(one, looks=None).method == f"{plain}, 2 looks"
    assert load_detector(one, looks=4).method == f"{plain}, 4 looks"
    assert load_detector(one, looks=1).method == plain
    for looks in (0, MOST_LOOKS + 1):
        with pytest.raises(InputError, match=f"1 to {MOST_LOOKS} looks"):
            load_detector(one, looks=looks)
    assert Detect().looks is None


def test_a_detector_that_sees_everybody_at_once_looks_once():
    assert load_detector(lambda image: None, looks=None).method.startswith("<lambda>")
    with pytest.raises(InputError, match=r"looks at all people at once; leave --set detect.looks=2 out"):
        load_detector(lambda image: None, looks=2)
