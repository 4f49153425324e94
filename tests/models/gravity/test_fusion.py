"""Who is heard about up, and who is believed when sources contradict each other."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from golden.ups import stated_deg, up_of
from pcnet3d.models.gravity.evidence import IMAGE, direction
from pcnet3d.models.gravity.fusion import fused_up
from pcnet3d.models.gravity.lines import tangent
from pcnet3d.models.gravity.votes import of_votes, pool
from pcnet3d.pipeline.core.camera import Look, pitch_roll_deg
from pcnet3d.pipeline.core.rotations import angle_deg
from refusals import refused

TIMES = np.arange(120) / 30


def look(pitch, roll=0.0, sd_deg=0.6, failure=0.004):
    up = up_of(pitch, roll)
    plane = tangent(up)
    return Look(0, up, plane @ (np.radians(sd_deg) ** 2 * np.eye(2)) @ plane.T, failure)


def votes(pitch, roll=0.0, scatter_deg=3.0):
    turns = np.random.default_rng(0).normal(scale=np.radians(scatter_deg), size=(len(TIMES), 3))
    return Rotation.from_rotvec(turns).apply(up_of(pitch, roll))


def fused(bodies, image=None, told=()):
    """The up, and what is said about contradictions."""
    found = fused_up(of_votes(pool(bodies, np.full(len(TIMES), 7.0), TIMES)), told, image)
    return found, found.notices


def test_beside_an_exact_image_bodies_are_told_and_have_no_say():
    """A lift that was told that up leans by it: what its bodies say is the image's word once more."""
    image = look(12)
    found, warnings = fused(votes(16), image)
    assert not warnings
    assert angle_deg(found.up, up_of(12)) < 1e-6
    assert found.shares == {IMAGE: 1.0}
    assert found.error_deg == pytest.approx(image.error_deg)
    assert angle_deg(found.own["frames"][0], up_of(16)) < 1.0
    # The same of what the user tells, and of both.
    told = direction("gravity vector", up_of(13), 1.0)
    assert fused(votes(16), None, [told])[0].shares == {"gravity vector": 1.0}
    assert fused(votes(16), image, [told])[0].shares.keys() == {IMAGE, "gravity vector"}


@pytest.mark.parametrize(("error_deg", "heard"), [(2.9, False), (3.1, True)])
def test_bodies_are_heard_beside_what_a_lifter_is_not_told(error_deg, heard):
    for image, told in (
        (look(12, sd_deg=error_deg / np.sqrt(2)), ()),
        (None, [direction("t", up_of(12), error_deg)]),
    ):
        found, _ = fused(votes(13), image, told)
        assert ("frames" in found.shares) is heard
        assert "frames" in found.own


def test_a_vague_image_and_bodies_are_fused_the_pitch_more_the_images_than_the_roll():
    bodies, image = pool(votes(16), np.full(len(TIMES), 7.0), TIMES), look(12, 4, sd_deg=3.0)
    found, warnings = fused(votes(16), image)
    assert not warnings
    sd = stated_deg(bodies.up, bodies.error_deg)
    way = (pitch_roll_deg(found.up) - pitch_roll_deg(bodies.up)) / ([12, 4] - pitch_roll_deg(bodies.up))
    np.testing.assert_allclose(way, sd**2 / (sd**2 + 9), atol=0.02)
    assert way[0] > 0.6 > 0.4 > way[1]
    assert found.shares[IMAGE] == pytest.approx(way.mean(), abs=0.02)
    assert found.pulls[IMAGE] > 0
    assert found.pulls["frames"] > 0
    assert angle_deg(found.own["frames"][0], up_of(16)) < 1.0


def test_an_image_with_many_lines_wins_over_leaning_bodies_and_both_are_named():
    found, (warning,) = fused(votes(50), look(20))
    assert angle_deg(found.up, up_of(20)) < 0.1
    assert found.shares == {IMAGE: 1.0}
    assert "pitch 20" in warning.text
    assert "The image is believed" in warning.text
    assert angle_deg(found.own["frames"][0], up_of(50)) < 1.5  # still there to be shown


@pytest.mark.parametrize("roll", [25, 30, 40])
def test_a_diagonal_pattern_is_vetoed_by_the_bodies_and_the_bound_reaches_it(roll):
    """Lines on one plane only are wrong in 15 of 100."""
    found, (warning,) = fused(votes(10), look(10, roll, failure=0.15))
    assert angle_deg(found.up, up_of(10)) < 1.0
    assert warning.values["believed"] == "body is"
    assert found.bound_deg >= warning.values["apart_deg"] - 1e-6


@pytest.mark.parametrize("pitch", [0, 15, 22, 30, 45])
@pytest.mark.parametrize("roll", [0, 15, 26, 45])
def test_good_lines_are_not_overruled_by_how_cameras_are_usually_held(pitch, roll):
    """Pitch 22, roll 26: lines were right within 2 degrees, the skeletons said 7 and 10 and were believed, and up was
    21 off. Bodies are drawn towards usual cameras."""
    image = look(pitch, roll, failure=0.01)
    found, said = fused(votes(0.5 * pitch + 4, 0.4 * roll), image)
    assert angle_deg(found.up, image.up) < 1.5
    assert all(each.values["believed"] == "image is" for each in said)


@pytest.mark.parametrize(
    ("failure", "believed", "close"),
    [
        (0.01, "image is", False),
        (0.06, "image is", True),
        (0.15, "body is", True),
        (0.6, "body is", False),
    ],
)
def test_the_bound_reaches_an_answer_that_is_hardly_less_likely(failure, believed, close):
    """Up was said to be known to within 12 degrees; the image's, 22 away, was hardly less likely, and right."""
    bodies, image = votes(1, -8), look(23, -13, failure=failure)
    found, (warning,) = fused(bodies, image)
    winner = fused(bodies)[0] if believed == "body is" else fused(np.full_like(bodies, np.nan), image)[0]
    apart_deg = warning.values["apart_deg"]
    assert warning.values["believed"] == believed
    assert angle_deg(found.up, winner.up) < 1e-3
    assert (found.bound_deg > apart_deg) == close
    assert (found.error_deg > winner.error_deg + 1) == close


def test_told_reaction_instead_of_gravity_is_refused_with_the_cause():
    bodies = of_votes(pool(votes(10), np.full(len(TIMES), 7.0), TIMES))
    for heard, image in ((bodies, None), ([], look(10)), (bodies, look(10))):
        with refused("wrong-axes"):
            fused_up(heard, [direction("gravity vector", -up_of(10), 1.0)], image)
    with refused("wrong-axes"):
        fused_up(bodies, [direction("gravity vector", up_of(10, 80), 1.0)])


def test_told_gravity_that_is_off_is_believed_and_said():
    found, warnings = fused(votes(10), look(10), [direction("gravity vector", up_of(40), 1.0)])
    assert any("the body" in each.text for each in warnings)
    assert any("the image" in each.text for each in warnings)
    assert angle_deg(found.up, up_of(40)) < 1e-3
    assert set(found.shares) == {"gravity vector"}
