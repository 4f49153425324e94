"""InstantHMR: what it is told and shown, and the body and place that come of its answers."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from golden.crops import FOCAL, SIZE, box_of, keypoints_of, lifted_by, mhr, placed, projected, shown
from pcnet3d.models import load_lifter
from pcnet3d.models.lifter.features import ray_rotation
from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, remap, rotate
from pcnet3d.pipeline.core.intrinsics import Intrinsics
from pcnet3d.pipeline.core.layouts import COCO23, FEET, MHR70


@pytest.mark.parametrize("kind", ["rtmw3d", "instanthmr"])
def test_flip_takes_out_what_a_network_prefers_on_one_side(request, body, showing, video, kind):
    """Always the same body, whose left wrist is too far out: half of that goes to the right wrist's side."""
    pixels = projected(placed(body, 0, 0, 4))
    showing([shown(pixels)])
    if kind == "rtmw3d":
        points = np.column_stack([0.5 + body[:, 0] / 2, 0.5 + body[:, 1] / 3, body[:, 2]])
        points[COCO23.index("l_wrist"), 0] += 0.1
    else:
        points = mhr(body)
        points[MHR70.index("l_wrist"), 0] += 0.2
    lifter = load_lifter(request.getfixturevalue(kind)(points))
    straight, fair = (
        lifted_by(lifter, keypoints_of(pixels[None]), SIZE, FOCAL, flip, video).joints[0].astype(float)
        for flip in (False, True)
    )
    left, right = H36M17.indices(("l_wrist", "r_wrist"))
    assert straight[left, 0] + straight[right, 0] > 0.1
    assert abs(fair[left, 0] + fair[right, 0]) < 0.02
    assert fair[left, 0] > 0 > fair[right, 0]


def test_instanthmr_gives_body_and_place_back(instanthmr, body, showing, video):
    """In the axes of its own camera, whose focal length is the image's diagonal."""
    showing([np.zeros((SIZE[1], SIZE[0], 3), np.uint8)] * 3)
    pixels = np.tile(projected(placed(body, 0.5, 0, 4)), (3, 1, 1))
    diagonal = float(np.hypot(*SIZE))
    lifter = load_lifter(instanthmr(mhr(body), (0.5, 0.1, 4.0)))
    lifted = lifted_by(lifter, keypoints_of(pixels), SIZE, diagonal, video=video)
    expected = remap(PoseSequence(mhr(body)[None], MHR70, CAMERA))
    expected = expected.joints - expected.joint("pelvis")[:, None]
    others = np.delete(np.arange(17), H36M17.index("nose"))
    assert_allclose(lifted.joints[:, others], np.repeat(expected[:, others], 3, axis=0), atol=1e-5)
    assert_allclose(lifted.root, [[0.5, 0.1, 4.0]] * 3, atol=1e-5)
    heel = body[COCO23.index("l_heel")]
    assert_allclose(lifted.feet[:, FEET.index("l_heel")], [heel] * 3, atol=1e-5)
    assert (lifted.frame.unit, lifted.frame.origin) == ("m", "pelvis")
    assert np.isnan(lifted.confidence).all()
    said = lifted.history[-1].options
    assert (said["kind"], said["focal_known"]) == ("instanthmr", True)
    assert lifted.root is not None
    assert "SAM License" in said["licence"]


def test_another_focal_length_turns_the_body_and_moves_it_along(instanthmr, body, showing, video):
    """Seen at the same pixel: at twice the focal length twice as far, and turned from the one ray to the other."""
    showing([np.zeros((SIZE[1], SIZE[0], 3), np.uint8)])
    diagonal = float(np.hypot(*SIZE))
    pixels = projected(placed(body, 1.0, 0.0, 4.0))[None]
    lifter = load_lifter(instanthmr(mhr(body), (1.0, 0.0, 4.0)))
    own, far = (lifted_by(lifter, keypoints_of(pixels), SIZE, f * diagonal, video=video) for f in (1, 2))
    assert_allclose(far.root, own.root * [1, 1, 2], atol=1e-5)
    middle, _ = box_of(pixels)
    middle /= diagonal
    turn = ray_rotation(middle / 2) @ ray_rotation(middle).T
    assert_allclose(far.joints[0], rotate(turn, own.joints[0].astype(float)), atol=2e-3)


def test_instanthmr_s_place_is_straightened_as_its_body_is(instanthmr, body, showing, video):
    """Where the network's own camera has the hips on their filmed pixel, they are where they were filmed."""
    import cv2

    showing([np.zeros((SIZE[1], SIZE[0], 3), np.uint8)])
    lens = Intrinsics((FOCAL, FOCAL), (660.0, 470.0), (-0.25, 0.08, 0.0, 0.0), image_size=SIZE)
    truth = np.array([0.9, 0.1, 3.2])
    still = np.zeros(3)
    points = np.concatenate([placed(body, *truth), truth[None]])
    filmed = cv2.projectPoints(points, still, still, lens.matrix, np.array(lens.distortion))[0][:, 0]
    diagonal = float(np.hypot(*SIZE))
    seen = np.append((filmed[-1] - np.array(SIZE) / 2) / diagonal, 1) * truth[2] * diagonal / FOCAL
    lifter = load_lifter(instanthmr(mhr(body), seen))
    lifted = lifted_by(lifter, keypoints_of(filmed[None, :-1]), SIZE, FOCAL, video=video, intrinsics=lens)
    assert_allclose(lifted.root, [truth], atol=1e-4)


def test_without_a_focal_length_instanthmr_s_place_is_not_believed(instanthmr, body, showing, video):
    showing([np.zeros((SIZE[1], SIZE[0], 3), np.uint8)])
    pixels = projected(placed(body, 0, 0, 4))[None]
    lifted = lifted_by(instanthmr(mhr(body), (0, 0, 4.0)), keypoints_of(pixels), SIZE, video=video)
    assert lifted.root is None
    assert not lifted.history[-1].options["focal_known"]


@pytest.mark.parametrize("angles", [False, True])
def test_instanthmr_is_told_where_the_box_is(instanthmr, body, showing, video, angles):
    """Its answer here is what it was told."""
    image = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    showing([image])
    pixels = projected(placed(body, 0.8, 0.3, 4.0))[None]
    path = instanthmr(np.zeros((70, 3)), metadata={"cliff_focal": "true"} if angles else {})
    lifted = lifted_by(path, keypoints_of(pixels), SIZE, FOCAL, video=video)
    middle, side = box_of(pixels)
    side *= 1.2
    told = [*(2 * middle / SIZE), side / SIZE[0] * FOCAL / np.hypot(*SIZE)]  # the last one as a depth
    if angles:
        told = [*np.arctan(middle / FOCAL), side / FOCAL]
    assert_allclose(lifted.root[0], told, rtol=0.02)


def test_instanthmr_sees_the_crop_as_imagenet_has_it(instanthmr, body, showing, video):
    """The nose's depth is the mean of the crop, here of a grey image that fills it."""
    grey = 90
    showing([np.full((SIZE[1], SIZE[0], 3), grey, np.uint8)])
    pixels = projected(placed(body, 0, 0, 6.0))[None]
    lifted = lifted_by(instanthmr(np.zeros((70, 3)), (0, 0, 6.0)), keypoints_of(pixels), SIZE, video=video)
    mean = np.mean((grey / 255 - np.array([0.485, 0.456, 0.406])) / [0.229, 0.224, 0.225])
    assert_allclose(lifted.joint("nose")[0], (0, 0, mean), atol=0.01)
