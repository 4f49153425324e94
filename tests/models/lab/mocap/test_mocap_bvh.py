"""BVH: channel orders, axes, units and names of small files with known answers; damaged ones refused."""

import numpy as np
import pytest

from golden.skeleton import MIXAMO, SKELETON, bent, bvh
from pcnet3d.models.lab.mocap.files import How, bvh_clip
from pcnet3d.pipeline import H36M17, InputError
from pcnet3d.pipeline.files import bvh as bvh_file

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


@pytest.fixture
def read(tmp_path):
    def read(text, **how):
        (tmp_path / "01_02.bvh").write_text(text)
        return bvh_clip(tmp_path / "01_02.bvh", tmp_path, How(**how))

    return read


def joint(clip, name):
    return clip.joints[:, H36M17.index(name)]


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


@pytest.mark.parametrize("order", ["ZXY", "XYZ", "YZX"])
def test_a_t_pose(read, order):
    """Faces -y in Z-up axes, so the left hand is at +x."""
    found = read(bvh(np.zeros((3, 16, 3)), order=order))
    clip = found.clip
    assert (clip.name, clip.subject, clip.source, clip.fps, len(clip)) == ("01_02", "01", "bvh", 30, 3)
    np.testing.assert_allclose(joint(clip, "l_wrist")[0], [0.17 + 0.28 + 0.25, 0, 0.9 + 0.46], atol=1e-4)
    np.testing.assert_allclose(joint(clip, "r_ankle")[0], [-0.09, 0, 0.9 - 0.89], atol=1e-4)
    np.testing.assert_allclose(joint(clip, "pelvis")[0], [0, 0, 0.86], atol=1e-4)
    assert joint(clip, "nose")[0, 1] < -0.04
    assert joint(clip, "head")[0, 2] == pytest.approx(0.9 + 0.62 + 0.13, abs=1e-4)
    assert found.notes == ("unit cm, by the length of the legs",)


def test_turning_left_is_about_the_vertical(read):
    """Hips turned by 90 degrees about Y: who faced -y now faces +x, the left hand at +y."""
    frames = np.zeros((2, 16, 3))
    frames[:, 0] = [0, 0, 90]  # Z, X, Y
    clip = read(bvh(frames)).clip
    np.testing.assert_allclose(joint(clip, "l_wrist")[0], [0, 0.7, 1.36], atol=1e-4)
    assert joint(clip, "nose")[0, 0] > 0.04


@pytest.mark.parametrize(
    ("unit", "scale"), [("m", 1), ("cm", 100), ("mm", 1000), ("inch", 1 / 0.0254), ("asf", 17.7165)]
)
def test_any_unit_gives_the_same_metres(read, unit, scale):
    frames = bent()
    metres = read(bvh(frames)).clip.joints
    guessed = read(bvh(frames, scale=scale))
    assert guessed.notes == (f"unit {unit}, by the length of the legs",)
    np.testing.assert_allclose(guessed.clip.joints, metres, atol=1e-4)
    told = read(bvh(frames, scale=scale), unit=unit)
    assert told.notes == ()
    np.testing.assert_allclose(told.clip.joints, metres, atol=1e-4)


def test_a_child_needs_its_unit_told(read):
    child = bvh(np.zeros((3, 16, 3)), scale=60)
    with pytest.raises(InputError, match="--unit"):
        read(child)
    assert joint(read(child, unit="cm").clip, "head")[0, 2] < 1.1


def test_bones_keep_their_length(read):
    clip = read(bvh(bent())).clip
    for a, b in (("l_knee", "l_ankle"), ("r_shoulder", "r_elbow")):
        length = np.linalg.norm(joint(clip, a) - joint(clip, b), axis=-1)
        np.testing.assert_allclose(length, np.linalg.norm(SKELETON[b][1]), atol=1e-4)


def test_a_leading_t_pose_is_left_out_and_said_so(read):
    frames = bent(30)
    frames[0] = 0
    found = read(bvh(frames))
    assert len(found.clip) == 20
    assert any("T-pose" in note for note in found.notes)


def test_a_mirrored_skeleton_is_refused(read):
    """Left and right names exchanged, knees bent: the knees bend the wrong way."""
    other = {
        joint: name.replace("Left", "?").replace("Right", "Left").replace("?", "Right")
        for joint, name in MIXAMO.items()
    }
    frames = np.zeros((40, 16, 3))
    frames[:, [2, 5], 1] = 60  # shanks back about x
    frames[:, [1, 4], 1] = -30
    frames[:, 0, 0] = 1
    read(bvh(frames))
    with pytest.raises(InputError, match="exchanged"):
        read(bvh(frames, names=other))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t: t.replace("Frames: 3", "Frames: 4"), "4 frames"),
        (lambda t: t.replace("MOTION", ""), "MOTION"),
        (lambda t: t.replace("Zrotation", "Wrotation", 1), "Wrotation"),
        (lambda t: t.replace("OFFSET", "OFFSET x", 1), "damaged"),
        (lambda t: t.replace("LeftFoot", "Flipper"), "Flipper"),
        (lambda t: t.replace("Frame Time: 0.0333333", "Frame Time: 0"), "frames"),
        (lambda t: t + "1 2\n", "damaged"),
        (lambda t: t.replace("90.00000", "nan", 1), "frames"),
        (lambda t: "", "BVH"),
    ],
)
def test_a_damaged_file_is_refused(read, change, words):
    with pytest.raises(InputError, match=words):
        read(change(bvh(np.zeros((3, 16, 3)))))
