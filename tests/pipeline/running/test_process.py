"""The whole chain from Python: files, arrays and functions in, a take or a folder out."""

import numpy as np
import pytest
import torch

import pcnet3d
from golden import numbered
from pcnet3d.adapters import read
from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import InputError, MadeBy, load_recipe, read_run
from refusals import refused

FPS, SIZE = numbered.FPS, (numbered.WIDTH, numbered.HEIGHT)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    return numbered.numbered_film(tmp_path_factory.mktemp("film") / "video.mp4")


@pytest.fixture(scope="module")
def keypoints() -> np.ndarray:
    """(60, 17, 3) COCO's joints with scores."""
    xy = numbered.joints_px()
    rng = np.random.default_rng(0)
    return np.concatenate([xy, rng.uniform(0.7, 0.95, (*xy.shape[:2], 1))], axis=-1).astype(np.float32)


@pytest.fixture(scope="module")
def joints() -> np.ndarray:
    """(60, 17, 3) the walker's in CAMERA, metres, from the pelvis."""
    walk = walker(fps=FPS, seconds=numbered.FRAMES / FPS)
    joints = camera_poses(walk, side_camera(walk)).joints
    return joints - joints[:, :1] + np.random.default_rng(0).normal(scale=1e-3, size=joints.shape)


def number_of(image: np.ndarray) -> int:
    return round((float(image[4:14, 4:14].mean()) - 8) / numbered.STEP)


@pytest.fixture
def lifter(joints):
    def motionbert(keypoints, size, fps):
        assert keypoints.shape == (numbered.FRAMES, 17, 3)
        assert np.isfinite(keypoints).all()
        assert (size, round(fps)) == (SIZE, FPS)
        return torch.tensor(joints)

    return motionbert


def knees(take) -> np.ndarray:
    return np.stack([take.kinematics[f"{side}_knee_flexion_deg"] for side in "lr"])


def test_functions_take_the_places_of_networks(film, keypoints, lifter, joints, tmp_path, monkeypatch):
    def rtmpose(image):
        assert image.shape == (numbered.HEIGHT, numbered.WIDTH, 3)
        assert image.dtype == np.uint8
        return keypoints[None, number_of(image)]

    monkeypatch.chdir(tmp_path)
    take = pcnet3d.process(video=film, detect=rtmpose, lift=lifter, unit="m")
    assert list(tmp_path.iterdir()) == []
    assert len(take.poses) == numbered.FRAMES
    np.testing.assert_allclose(take.poses.joints, joints, atol=1e-2)
    assert take.poses.frame.unit == "m"
    assert take.poses.made_by == MadeBy("estimated", "motionbert (a function)", in_run=True)
    assert take.rectified.level_ok
    assert take.keypoints.made_by.by == "rtmpose (a function)"
    told = pcnet3d.process(poses=joints, unit="m", fps=FPS)
    np.testing.assert_allclose(knees(take), knees(told), atol=3)


def test_arrays_files_and_what_read_gives_say_the_same(save, film, keypoints, joints):
    quick = {"video": film, "settings": {"calibrate": "off", "measures": "off"}}
    arrays = pcnet3d.process(**quick, keypoints=keypoints, poses=joints, unit="m")
    files = pcnet3d.process(
        **quick,
        keypoints=save(keypoints, "keypoints.npy"),
        poses=save(joints.astype(np.float32)),
        adapter="videopose3d",
    )
    given = pcnet3d.process(
        **quick,
        keypoints=read(save(keypoints, "keypoints.npy"), gives="keypoints"),
        poses=read(save(joints.astype(np.float32)), "videopose3d"),
    )
    for other in (files, given):
        np.testing.assert_allclose(knees(arrays), knees(other), atol=1e-3)
        np.testing.assert_array_equal(arrays.keypoints.joints, other.keypoints.joints)
    assert [entry["role"] for entry in arrays.inputs] == ["poses", "keypoints", "video"]
    assert {len(entry["sha256"]) for entry in arrays.inputs} == {64}


def test_keypoints_alone_are_lifted(keypoints, lifter):
    take = pcnet3d.process(keypoints=keypoints, fps=FPS, image_size=SIZE, lift=lifter)
    assert take.poses.frame.unit == "arbitrary"
    assert take.rectified.level_ok
    built_in = pcnet3d.process(keypoints=keypoints[..., :2], fps=FPS, image_size=SIZE)
    assert np.isfinite(built_in.poses.joints).all()


def test_missing_joints_reach_a_function_on_a_line_without_a_score(keypoints, joints):
    keypoints = keypoints.copy()
    keypoints[20:22, 9], keypoints[30] = 0, np.nan

    def look(given, size, fps):
        assert (given[20:22, 9, 2] == 0).all()
        np.testing.assert_allclose(given[20, 9, :2], (2 * given[19, 9, :2] + given[22, 9, :2]) / 3, rtol=1e-4)
        assert given.shape == (60, 17, 3)
        assert (given[30, :, 2] == 0).all()
        return joints

    take = pcnet3d.process(keypoints=keypoints, fps=FPS, image_size=SIZE, lift=look)
    assert take.poses.frame_index.tolist() == list(range(60))  # `clean` fills the gap
    assert next(step for step in take.poses.history if step.name == "lift").options["joints_on_a_line"] == 2


def test_whole_bodies_and_named_layouts(keypoints, lifter):
    everything = np.zeros((60, 133, 3), np.float32)
    everything[:, :17] = keypoints
    everything[:, 17:23] = keypoints[:, 15:16]

    def lift(given, size, fps):
        assert given.shape[1] in (17, 23)
        return lifter(given[:, :17], size, fps)

    pcnet3d.process(keypoints=everything, fps=FPS, image_size=SIZE, lift=lift)
    with refused("wrong-content", "17"):
        pcnet3d.process(keypoints=keypoints, keypoint_joints="HALPE26", fps=FPS, image_size=SIZE)


def test_run_writes_what_the_command_writes(joints, tmp_path):
    take = pcnet3d.process(output=tmp_path / "results", poses=joints, unit="m", fps=FPS, also=("csv",))
    names = {path.name for path in (tmp_path / "results").iterdir()}
    assert {"take.rrd", "report.html", "poses.npz", "kinematics.csv", "summary.json"} <= names
    np.testing.assert_allclose(knees(read_run(tmp_path / "results")), knees(take), atol=1e-3)
    with refused("already-there"):
        (tmp_path / "other").mkdir()
        (tmp_path / "other" / "mine.txt").touch()
        pcnet3d.process(output=tmp_path / "other", poses=joints, fps=FPS)


def test_options_are_those_of_a_run(joints):
    part = pcnet3d.process(poses=joints, fps=FPS, time_range=(0.5, 1.5), settings={"measures": "off"})
    assert (len(part.poses), part.measures) == (31, None)
    recipe = load_recipe().without("angles").without("measures").without("report").without("record")
    assert pcnet3d.process(poses=joints, fps=FPS, recipe=recipe.without("export")).kinematics is not None


def test_a_lift_that_is_mirrored_is_refused(joints, keypoints):
    with refused("sides-swapped"):
        pcnet3d.process(keypoints=keypoints, fps=FPS, image_size=SIZE, lift=lambda *_: joints * [-1, 1, 1])


def broken(image):
    raise ValueError("out of memory")


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (
            broken,
            "frame 0: The function broken, given as detect, failed: it raised ValueError: out of memory",
        ),
        (lambda image: np.zeros((17, 3)), "(17, 3)"),
        (lambda image: np.ones((1, 17, 2)), "(1, 17, 2)"),
        (lambda image: np.ones((1, 5, 3)), "5"),
        (lambda image: np.full((1, 17, 3), np.inf), "infinite"),
        (lambda image: "people", "frame 0"),
        (lambda image: 5, "frame 0"),
        (lambda image: np.full((1, 17 + (number_of(image) > 6), 3), 50.0), "frame 7"),
    ],
)
def test_a_detector_that_fails_is_told_with_its_name_and_the_frame(film, answer, said):
    with refused("plugin-broken", said, answer.__name__):
        pcnet3d.process(video=film, detect=answer)


@pytest.mark.parametrize("nobody", [None, [], np.zeros((0, 17, 3)), np.full((1, 17, 3), np.nan)])
def test_nobody_in_any_image(film, nobody):
    with refused("nothing-usable", "a function"):
        pcnet3d.process(video=film, detect=lambda image: nobody)


@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda keypoints, size: keypoints, "TypeError"),
        (lambda keypoints, size, fps: np.zeros((59, 17, 3)), "(59, 17, 3)"),
        (lambda keypoints, size, fps: np.zeros((60, 16, 3)), "(60, 16, 3)"),
        (lambda keypoints, size, fps: None, "got nothing"),
        (lambda keypoints, size, fps: np.full((60, 17, 3), np.nan), "NaN"),
    ],
)
def test_a_lifter_that_fails_is_told_with_its_name_and_the_frames(keypoints, answer, said):
    with refused("plugin-broken", said, "lift", "<lambda>", "frames 0 to 59"):
        pcnet3d.process(keypoints=keypoints, fps=FPS, image_size=SIZE, lift=answer)


def test_what_a_function_raised_is_the_cause_of_the_refusal(keypoints, film):
    for given in (
        {"keypoints": keypoints, "fps": FPS, "image_size": SIZE, "lift": broken},
        {"video": film, "detect": broken},
    ):
        with pytest.raises(InputError) as refusal:
            pcnet3d.process(**given)
        assert isinstance(refusal.value.__cause__, TypeError | ValueError)


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        (lambda points, joints: {}, "needs-input"),
        (lambda points, joints: {"poses": joints}, "needs-rate"),
        (lambda points, joints: {"poses": joints, "fps": FPS, "also": ("csv",)}, "option-conflict"),
        (lambda points, joints: {"poses": joints, "fps": FPS, "lift": len}, "option-conflict"),
        (lambda points, joints: {"poses": joints, "fps": FPS, "detect": len}, "option-conflict"),
        (lambda points, joints: {"poses": joints, "fps": FPS, "adapter": "motionbert"}, "option-conflict"),
        (lambda points, joints: {"keypoints": points, "fps": FPS, "axes": "z-up"}, "option-conflict"),
        (lambda points, joints: {"keypoints": "k.json", "keypoint_joints": "COCO17"}, "option-conflict"),
        (lambda points, joints: {"keypoints": points, "unit": "m"}, "option-conflict"),
        (lambda points, joints: {"video": np.zeros((9, 8, 8, 3))}, "bad-value"),
        (lambda points, joints: {"poses": joints, "fpss": FPS}, "name-unknown"),
        (lambda points, joints: {"poses": points[..., :2], "fps": FPS}, "wrong-content"),
        (lambda points, joints: {"keypoints": joints[:, :, None], "fps": FPS}, "wrong-content"),
        (lambda points, joints: {"keypoints": points * 0, "fps": FPS}, "nothing-usable"),
        (lambda points, joints: {"keypoints": points[:50], "poses": joints, "fps": FPS}, "files-apart"),
    ],
)
def test_what_does_not_fit_is_refused(keypoints, joints, asked, code):
    with refused(code):
        pcnet3d.process(**asked(keypoints, joints))


@pytest.mark.parametrize("said", [{"unit": "mm"}, {"axes": "z-up"}, {"joints": "COCO17"}])
def test_what_a_file_of_poses_says_is_refused_by_the_name_that_was_given(said):
    with refused("option-conflict", f"{next(iter(said))}: expected this of an array"):
        pcnet3d.process(poses="poses.npy", fps=FPS, **said)


@pytest.mark.parametrize(
    "given", [{"keypoints": "k.json"}, {"video": "v.mp4"}, {"video": "v.mp4", "detect": "rtmo"}]
)
def test_joints_of_a_file_are_refused_with_what_names_them(given):
    with refused("option-conflict", "keypoint_joints", "keypoints.layout"):
        pcnet3d.process(keypoint_joints="COCO17", **given)
