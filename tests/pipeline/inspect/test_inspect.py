"""`pcnet3d inspect`: a clean walker has no fault, and each fault that is put into it is found, alone."""

import json

import numpy as np
import pytest

from commands import pcnet3d, succeeded
from pcnet3d import process
from pcnet3d.adapters import read
from pcnet3d.examples.walker.camera import aimed
from pcnet3d.examples.walker.walk import walker as built_in
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.inspect.inspect import inspect
from pcnet3d.pipeline.reading.findings import UNNUMBERED, depth_factors
from refusals import refused

CAMERA = {"layout": "H36M17", "frame": "CAMERA", "unit": "m"}
WORLD = CAMERA | {"frame": "Z_UP"}
FRAMES, FPS = 90, 30
AWAY = 2  # index of the axis


@pytest.fixture
def walker() -> np.ndarray:
    """(90, 17, 3) metres, CAMERA: walks towards the camera in a bend, rigid bones."""
    walk = built_in(seconds=8, turn_deg=-120)
    camera = aimed(walk.root[45], 5.0, walk.heading_deg[45] + 180, pitch_deg=0, roll_deg=0)
    return camera.points(walk.world)[:FRAMES].astype(np.float64)


def saved(tmp_path, joints, **beside):
    rows = np.arange(len(joints))
    arrays = {
        "joints": np.asarray(joints, dtype=np.float32),
        "time_s": rows / FPS,
        "frame_index": rows,
    } | beside
    np.savez(tmp_path / "poses.npz", **{name: array for name, array in arrays.items() if array is not None})
    return tmp_path / "poses.npz"


def looked_at(tmp_path, joints, options=CAMERA, **beside):
    return inspect(saved(tmp_path, joints, **beside), "arrays", options)


def faults(found):
    """name -> weight of what is more than a note."""
    return {f.code: f.weight for person in found.people for f in person.findings if f.weight != "note"}


def test_a_clean_walker_is_good_and_described(walker, tmp_path):
    found = looked_at(tmp_path, walker)
    assert found.people[0].findings == ()
    assert found.verdict == "good"
    figures = found.people[0].figures()
    assert [figures[name] for name in ("layout", "frame", "unit", "rows")] == [
        "H36M17",
        "CAMERA",
        "m",
        FRAMES,
    ]
    assert (figures["first_frame"], figures["last_frame"]) == (0, FRAMES - 1)
    assert figures["fps"] == pytest.approx(FPS)
    assert figures["stature_m"] == pytest.approx(1.7, abs=0.1)
    assert figures["bone_spreads"]["r_hip-r_knee"] < 1e-3
    assert "adapter arrays" in str(found)


def test_what_the_file_does_not_say_is_a_note(walker, tmp_path):
    found = looked_at(tmp_path, walker, time_s=None, frame_index=None)
    said = [(each.code, each.weight, each.values["what"]) for each in found.people[0].findings]
    assert said == [("not-stated", "note", what) for what in (UNNUMBERED, "its frame rate")]
    assert found.verdict == "good"


def copied(into, source):
    """Spoils joints (T, 17, 3): what lies at one index is what lies at another."""

    def spoil(joints):
        joints[into] = joints[source]
        return joints

    return spoil


def lost(first, end):
    def spoil(joints):
        joints[first:end] = np.nan
        return joints

    return spoil


def scaled(*factors):
    return lambda joints: joints * factors


LEGS = H36M17.indices([f"{side}_{part}" for side in "lr" for part in ("hip", "knee", "ankle")])
halted = copied(np.s_[40:44], 40)
mirrored = scaled(-1, 1, 1)
flat = copied(np.s_[..., AWAY], np.s_[:, :1, AWAY])
invented = copied(np.s_[..., AWAY], np.s_[0, :, AWAY])


def rubber(joints):
    pulse = 1 + 0.55 * np.sin(np.arange(FRAMES))[:, None]
    for side in "lr":
        for above, below in (("hip", "knee"), ("shoulder", "elbow"), ("knee", "ankle"), ("elbow", "wrist")):
            start, end = (H36M17.index(f"{side}_{part}") for part in (above, below))
            joints[:, end] = joints[:, start] + pulse * (joints[:, end] - joints[:, start])
    return joints


def leaping(joints):
    joints[45:] = joints[45:] * [-1, 1, -1] + [0, 0, 2 * joints[45, 0, AWAY]]
    return joints


@pytest.mark.parametrize(
    ("spoil", "name", "weight"),
    [
        (lost(20, 38), "gaps", "suspicious"),
        (lost(20, 80), "gaps", "unusable"),
        (halted, "duplicates", "suspicious"),
        (copied(np.s_[10:], 10), "duplicates", "unusable"),
        (scaled(1.15, 1.15, 0.45), "depth-scaled", "suspicious"),  # without the 1.15 the stature tells too
        (mirrored, "mirrored", "unusable"),
        (copied(np.s_[:, LEGS], np.s_[:, H36M17.mirror[LEGS]]), "legs-against-arms", "unusable"),
        (scaled(1000), "stature", "unusable"),
        (scaled(0.5), "stature", "suspicious"),
        (scaled(-1, -1, 1), "upside-down", "unusable"),  # still right-handed; a run refuses it
        (leaping, "leaps", "suspicious"),
    ],
)
def test_a_fault_is_found_alone(walker, tmp_path, spoil, name, weight):
    found = looked_at(tmp_path, spoil(walker.copy()))
    assert faults(found) == {name: weight}
    assert found.verdict == weight


def test_who_walks_exactly_along_one_axis_has_lost_nothing(walker, tmp_path):
    """Nothing moves across the walk, as of a simulated body, but bones keep their lengths: "that axis is invented"."""
    planar = (walker - walker[:, :1]).astype(np.float64)
    planar[..., 0] = planar[..., 0].mean(axis=0)
    assert "axis-invented" not in faults(looked_at(tmp_path, planar))


def test_a_body_on_its_side_before_a_camera_is_what_a_run_calls_it(walker, tmp_path):
    """y and z exchanged: inspect said "good"."""
    turned = (walker - walker[:, :1])[..., [0, 2, 1]] * [1, 1, -1]
    assert faults(looked_at(tmp_path, turned)) == {"nobody-upright": "suspicious"}
    path = tmp_path / "poses.npy"
    np.save(path, turned.astype(np.float32))
    said = process(poses=path, adapter="arrays", options=CAMERA, fps=FPS).judged
    assert "nobody-upright" in [each.code for each in said]


def test_a_world_whose_other_axis_is_up_is_suspicious(walker, tmp_path):
    """The poses were called good, and the walker kicked. Who stays where they are may lie."""
    assert faults(looked_at(tmp_path, walker, WORLD)) == {"on-its-side": "suspicious"}
    stays = walker - walker[:, :1] + walker[:, :1] / 100
    assert faults(looked_at(tmp_path, stays, WORLD)) == {"on-its-side": "warning"}


@pytest.mark.parametrize(
    ("spoil", "name"), [(flat, "flat"), (invented, "axis-invented"), (rubber, "bones"), (leaping, "leaps")]
)
def test_a_capture_without_a_head_is_read_and_good_and_its_faults_are_found(walker, tmp_path, spoil, name):
    """Each of its frames counted as missing."""
    assert faults(looked_at(tmp_path, spoil(walker.copy())))[name] == (
        "suspicious" if name == "leaps" else "unusable"
    )
    lacking = H36M17.indices(["nose", "head"])
    sound, spoilt = walker.copy(), spoil(walker.copy())
    sound[:, lacking] = spoilt[:, lacking] = np.nan
    assert faults(looked_at(tmp_path, sound)) == {}
    assert name in faults(looked_at(tmp_path, spoilt))
    assert len(read(saved(tmp_path, sound), "arrays", **CAMERA)) == FRAMES


def test_without_a_joint_of_the_trunk_there_is_no_pose(walker, tmp_path):
    walker[:, H36M17.index("l_hip")] = np.nan
    assert faults(looked_at(tmp_path, walker))["gaps"] == "unusable"
    assert [each.code for each in read(saved(tmp_path, walker), "arrays", **CAMERA).notices] == [
        "frames-as-gaps"
    ]


def test_a_joint_that_is_never_there_hides_no_repeated_and_no_failed_row(walker, tmp_path):
    failed = halted(walker.copy())
    failed[60:62] = 0
    failed[:, H36M17.index("head")] = np.nan
    said = {f.code: f.text for f in looked_at(tmp_path, failed).people[0].findings}
    assert said["duplicates"].startswith("3 rows repeat the row before exactly, first at row 41")
    assert said["gaps"].endswith(
        ": 2 with all joints at one point."
    )  # "35 without a row, 0 with NaN, 0 with ..."


def test_rows_in_which_the_pelvis_alone_is_there_repeat_nothing(walker, tmp_path):
    """It is 0 throughout, and the same frames were counted as gaps already."""
    missing = walker.copy()
    missing[:, H36M17.index("pelvis")] = 0.0
    missing[40:60, H36M17.index("pelvis") + 1 :] = np.nan
    codes = {found.code for found in looked_at(tmp_path, missing).people[0].findings}
    assert codes & {"gaps", "duplicates"} == {"gaps"}


def test_dropped_frames_are_counted_by_their_numbers(walker, tmp_path):
    kept = np.r_[0:30, 45:FRAMES]
    found = looked_at(tmp_path, walker[kept], time_s=kept / FPS, frame_index=kept)
    assert faults(found) == {"gaps": "suspicious"}
    assert "15 of 90 frames" in str(found)


@pytest.mark.parametrize("factor", [1.0, 2.5])
def test_that_by_which_depth_was_divided_is_known_within_what_noise_leaves_open(walker, tmp_path, factor):
    poses = looked_at(tmp_path, walker / [1, 1, factor]).people[0].poses
    least, most = depth_factors(poses)
    assert least < 1.01 * factor
    assert most > 0.99 * factor
    assert most < 1.3 * least


@pytest.mark.parametrize(("share", "told"), [(0.1, False), (1.0, True)])
def test_depth_is_not_judged_of_one_who_stands_still(walker, tmp_path, share, told):
    """Of a video of one photo the page said that bones get longer when they turn towards the camera."""
    moving = walker.mean(axis=0) + share * (walker - walker.mean(axis=0))
    assert ("depth-scaled" in faults(looked_at(tmp_path, moving * [1, 1, 1.8]))) == told


def test_noise_in_depth_is_not_taken_for_too_much_depth(walker, tmp_path):
    """Bones get longer by it the more they turn towards the camera, which was said of kicks and squats."""
    noisy = walker.copy()
    noisy[..., AWAY] += np.random.default_rng(0).normal(0, 0.1, noisy.shape[:2])
    assert "depth-scaled" not in faults(looked_at(tmp_path, noisy))
    assert "depth-scaled" in faults(looked_at(tmp_path, walker * [1, 1, 1.8]))


def test_clip_boundaries_are_told(walker, tmp_path):
    walker[0, 0, AWAY] = 0
    np.save(tmp_path / "X3D.npy", (np.concatenate([walker] * 3) / 3).astype(np.float32))
    (person,) = inspect(tmp_path / "X3D.npy", "motionbert").people
    (said,) = (finding for finding in person.findings if finding.code == "seam")
    assert (said.weight, "row 243" in said.text) == ("note", True)


def test_one_frame_is_described_but_not_called_good(walker, tmp_path):
    assert faults(looked_at(tmp_path, walker[:1])) == {"too-few-frames": "suspicious"}


def pictured(tmp_path, joints):
    """What a pinhole sees of it, as one track of AlphaPose's, COCO-17."""
    names = ("nose", "nose", "nose", "nose", "nose", *(
        f"{side}_{part}" for part in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle") for side in "lr"
    ))  # fmt: skip
    seen = joints[:, H36M17.indices(names)]
    points = 900 * seen[..., :2] / seen[..., 2:] + [640, 360]
    rows = [np.column_stack([row, np.full(17, 0.9)]).ravel().tolist() for row in points]
    content = [
        {"image_id": f"{i}.jpg", "category_id": 1, "keypoints": row, "score": 2.0, "idx": 1}
        for i, row in enumerate(rows)
    ]
    (tmp_path / "alphapose-results.json").write_text(json.dumps(content))
    return tmp_path / "alphapose-results.json"


def test_several_people_are_told_apart_and_one_can_be_asked_for(walker, tmp_path):
    path = pictured(tmp_path, walker)
    first = json.loads(path.read_text())
    second = [detection | {"idx": 2} for detection in first[:40]]
    path.write_text(json.dumps(first + second))
    found = inspect(path)
    assert {one.source.person: len(one.source) for one in found.people} == {"1": FRAMES, "2": 40}
    assert "2 people" in str(found)
    assert [one.source.person for one in inspect(path, person="2").people] == ["2"]


def test_keypoints_alone_are_inspected_too(walker, tmp_path):
    found = inspect(pictured(tmp_path, walker))
    assert (found.adapter, found.people[0].poses, found.verdict) == ("json2d", None, "good")


def test_frames_that_are_all_lost_are_unusable_and_no_file_at_all_is_an_error(walker, tmp_path):
    assert faults(looked_at(tmp_path, walker * 0))["refused"] == "unusable"
    with refused("cannot-open"):
        inspect(tmp_path / "none.npy")


def test_the_command_prints_json_and_ends_with_the_verdicts_code(walker, tmp_path):
    options = [text for key, value in CAMERA.items() for text in ("-O", f"{key}={value}")]
    told = ["--adapter", "arrays", *options]
    good = succeeded(pcnet3d("inspect", saved(tmp_path, walker), *told, "--json"))
    assert json.loads(good.stdout)["people"][0]["verdict"] == "good"
    for spoil, code in ((halted, 3), (mirrored, 4)):
        result = pcnet3d("inspect", saved(tmp_path, spoil(walker.copy())), *told)
        assert result.returncode == code, result.stdout + result.stderr
    (tmp_path / "no.npy").write_text("no poses")
    assert pcnet3d("inspect", tmp_path / "no.npy").returncode == 2


@pytest.mark.data("native")
@pytest.mark.parametrize(
    ("name", "verdict"), [("boxing", "good"), ("cycling", "suspicious"), ("broken", "unusable")]
)
def test_real_lifts_get_their_verdicts(data, name, verdict):
    assert inspect(data / "native" / "motionbert" / f"{name}_X3D.npy").verdict == verdict
