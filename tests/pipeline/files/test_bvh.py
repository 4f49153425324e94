"""BVH: channel orders, axes, units and names of small files with known answers; damaged ones refused."""

import numpy as np
import pytest

from golden.skeleton import bent, bvh
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.files import bvh as bvh_file
from pcnet3d.pipeline.files.bvh import read_motion

CHAIN = """HIERARCHY
ROOT a
{{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition {order}
  JOINT b
  {{
    OFFSET 0 1 0
    CHANNELS {more} {place}{order}
    End Site
    {{
      OFFSET 0 1 0
    }}
  }}
}}
MOTION
Frames: 1
Frame Time: 0.0083333
{numbers}
"""


def chain(numbers=(0,) * 9, order="ZYX", place=""):
    rotations = " ".join(f"{axis}rotation" for axis in order)
    return CHAIN.format(
        order=rotations, more=6 if place else 3, place=place, numbers=" ".join(map(str, numbers))
    )


def joint(motion, name):
    return motion.joints[:, H36M17.index(name)]


@pytest.mark.parametrize(
    ("order", "angles", "end"),
    [
        # R = R_1 R_2 R_3: the last channel turns the bone (0, 1, 0) first.
        ("ZYX", (90, 0, 90), (0, 0, 1)),  # x first: y -> z; then z leaves it
        ("XYZ", (90, 0, 90), (-1, 0, 0)),  # z first: y -> -x; then x leaves it
        ("YXZ", (90, 90, 0), (1, 0, 0)),  # x: y -> z; then y: z -> x
        ("XYZ", (0, 90, 0), (0, 1, 0)),
    ],
)
def test_the_channels_order_is_the_order_of_multiplication(order, angles, end):
    text = chain((1, 2, 3, *angles, 0, 0, 0), order)
    skeleton, channels, frames, fps = bvh_file.parse(text)
    assert fps == 120
    joints, _ = bvh_file.pose(skeleton, channels, frames)
    np.testing.assert_allclose(joints[0, 0], [1, 2, 3])
    np.testing.assert_allclose(joints[0, 1] - joints[0, 0], end, atol=1e-9)


def test_a_rate_is_rounded_no_further_than_its_digits_leave_it_open():
    for frame_time, fps in [
        ("0.0333333", 30),
        ("0.033333", 30),
        ("3.33333E-02", 30),
        ("0.033", 1 / 0.033),  # nobody knows
        ("0.0333667", 1 / 0.0333667),
        ("0.033366700", 29.97),
        ("0.0417083", 24 / 1.001),
        ("0.016666", 60),  # cut off, not rounded
        ("0.0166833", 60 / 1.001),
        ("0.0083333", 120),
        ("0.008", 125),
        ("0.04", 25),
        ("2", 0.5),
    ]:
        text = chain().replace("0.0083333", frame_time)
        assert bvh_file.parse(text)[-1] == pytest.approx(fps, rel=1e-5 if fps != round(fps) else 1e-12)


@pytest.mark.parametrize("frame_time", ["0", "-1", "nan", "inf", "1e-320"])
def test_a_frame_time_that_is_none(frame_time):
    with pytest.raises(InputError, match="s each"):
        bvh_file.parse(chain().replace("0.0083333", frame_time))


def test_position_channels_of_a_joint_stand_in_for_its_offset():
    text = chain((0, 0, 0, 90, 0, 0, 0, 3, 0, 0, 0, 0), place="Xposition Yposition Zposition ")
    joints, _ = bvh_file.pose(*bvh_file.parse(text)[:3])
    np.testing.assert_allclose(joints[0, 1], [-3, 0, 0], atol=1e-12)


def test_channels_of_an_end_site_turn_nothing():
    text = chain((0, 0, 0, 90, 0, 0, 0, 0, 0))
    end = "End Site\n    {\n"
    more = text.replace(end, f"{end}CHANNELS 2 Xrotation Yrotation\n").rstrip() + " 30 60\n"
    for found, usual in zip(
        *(bvh_file.pose(*bvh_file.parse(each)[:3]) for each in (more, text)), strict=True
    ):
        np.testing.assert_array_equal(found, usual)


@pytest.mark.parametrize("order", ["ZXY", "XYZ", "YZX"])
def test_a_t_pose(order):
    """Faces +z, so the left hand is at +x."""
    motion = read_motion(bvh(np.zeros((3, 16, 3)), order=order))
    assert (motion.unit, motion.fps, motion.first, len(motion.joints)) == ("cm", 30, 0, 3)
    np.testing.assert_allclose(joint(motion, "l_wrist")[0], [0.17 + 0.28 + 0.25, 0.9 + 0.46, 0], atol=1e-4)
    np.testing.assert_allclose(joint(motion, "r_ankle")[0], [-0.09, 0.9 - 0.89, 0], atol=1e-4)
    np.testing.assert_allclose(joint(motion, "pelvis")[0], [0, 0.86, 0], atol=1e-4)
    assert joint(motion, "nose")[0, 2] > 0.04
    assert joint(motion, "head")[0, 1] == pytest.approx(0.9 + 0.62 + 0.13, abs=1e-4)


def test_turning_left_is_about_the_vertical():
    """Hips turned by 90 degrees about y: who faced +z now faces +x, the left hand at -z."""
    frames = np.zeros((2, 16, 3))
    frames[:, 0] = [0, 0, 90]  # Z, X, Y
    motion = read_motion(bvh(frames))
    np.testing.assert_allclose(joint(motion, "l_wrist")[0], [0, 1.36, -0.7], atol=1e-4)
    assert joint(motion, "nose")[0, 0] > 0.04


@pytest.mark.parametrize(
    ("unit", "scale"), [("m", 1), ("cm", 100), ("mm", 1000), ("inch", 1 / 0.0254), ("asf", 17.7165)]
)
def test_any_unit_gives_the_same_metres(unit, scale):
    metres = read_motion(bvh(bent())).joints
    guessed = read_motion(bvh(bent(), scale=scale))
    assert guessed.unit == unit
    np.testing.assert_allclose(guessed.joints, metres, atol=1e-4)
    np.testing.assert_allclose(read_motion(bvh(bent(), scale=scale), unit).joints, metres, atol=1e-4)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace("Frames: 3", "Frames: 4"), "4 frames"),
        (lambda t: t.replace("MOTION", ""), "MOTION"),
        (lambda t: t.replace("Zrotation", "Wrotation", 1), "Wrotation"),
        (lambda t: t.replace("Zrotation", "Xrotation", 1), "each once"),
        (lambda t: t.replace("OFFSET", "OFFSET x", 1), "damaged"),
        (lambda t: t.replace("LeftFoot", "Flipper"), "Flipper"),
        (lambda t: t + "1 2\n", "damaged"),
        (lambda t: t.replace("90.000000", "nan", 1), "frames"),
        (lambda t: "", "BVH"),
    ],
)
def test_a_damaged_file_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        read_motion(change(bvh(np.zeros((3, 16, 3)))))
