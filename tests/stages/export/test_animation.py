"""skeleton.bvh and skeleton.glb, opened by readers that are not ours, against the take's joints; and the animated
skeleton: where its joints are, how it stands at rest, what a gap does."""

import json
import os
import shutil
import struct
import subprocess
import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pcnet3d.adapters import bvh
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, InputError, Pipeline, Take
from pcnet3d.pipeline.core.rotations import geodesic_deg, rotate, unit
from pcnet3d.pipeline.files.skeletons import place
from pcnet3d.pipeline.signals.checks import without_made_nose
from pcnet3d.stages.export.animation import ANIMATION, armature, write_bvh, write_glb
from pcnet3d.stages.export.markers import evenly, markers
from pcnet3d.stages.export.stage import Export
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories
from refusals import refused

_NUMBERS = {5121: np.uint8, 5123: np.uint16, 5126: np.float32}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}
_VALIDATE = """
const validator = require('gltf-validator');
const file = new Uint8Array(require('fs').readFileSync(process.argv[1]));
validator.validateBytes(file).then(report => console.log(JSON.stringify(report)));
"""
_OPEN_IN_BLENDER = """
import sys, json, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
begins = int(sys.argv[1].endswith(".bvh"))  # the number of the first frame
if begins:
    bpy.ops.preferences.addon_enable(module="io_anim_bvh")
    bpy.ops.import_anim.bvh(filepath=sys.argv[1], update_scene_fps=True)
else:
    bpy.ops.import_scene.gltf(filepath=sys.argv[1])
(armature,) = (each for each in bpy.data.objects if each.type == "ARMATURE")
bodies = [each for each in bpy.data.objects if each.type == "MESH" and each.parent == armature]
scene, bones = bpy.context.scene, armature.data.bones
scene.frame_set(begins + int(float(sys.argv[2]) * scene.render.fps))
print("found", json.dumps({
    "modifiers": [each.type for body in bodies for each in body.modifiers],
    "groups": [each.name for body in bodies for each in body.vertex_groups],
    "rest": {each.name: [list(each.head_local), list(each.tail_local)] for each in bones},
    "posed": {each.name: list(armature.matrix_world @ each.head) for each in armature.pose.bones},
}))
"""


@pytest.fixture
def glb(tmp_path):
    """glb(take): the JSON of its file, its arrays, and the path."""

    def make(take):
        path = tmp_path / "skeleton.glb"
        write_glb(take, path)
        return (*read_glb(path.read_bytes()), path)

    return make


def read_glb(content: bytes) -> tuple[dict, list[np.ndarray]]:
    """By glTF 2.0, sections 3.6 and 4.4: chunks, alignment, sizes, the least and greatest value of each accessor."""
    magic, version, length = struct.unpack_from("<4sII", content)
    assert (magic, version, length) == (b"glTF", 2, len(content))
    text_size, kind = struct.unpack_from("<I4s", content, 12)
    assert kind == b"JSON"
    assert text_size % 4 == 0
    found = json.loads(content[20 : 20 + text_size])
    data_size, kind = struct.unpack_from("<I4s", content, 20 + text_size)
    assert kind == b"BIN\0"
    data = content[28 + text_size :]
    assert len(data) == data_size == found["buffers"][0]["byteLength"]
    assert data_size % 4 == 0
    arrays = []

    def stored(view: int, kind: int) -> np.ndarray:
        told = found["bufferViews"][view]
        assert told["byteOffset"] % 4 == 0
        return np.frombuffer(
            data[told["byteOffset"] : told["byteOffset"] + told["byteLength"]], _NUMBERS[kind]
        )

    for accessor in found["accessors"]:
        shape = accessor["count"], _WIDTHS[accessor["type"]]
        values = stored(accessor["bufferView"], accessor["componentType"]).reshape(shape)
        np.testing.assert_array_equal(values.min(axis=0), np.array(accessor["min"], values.dtype))
        np.testing.assert_array_equal(values.max(axis=0), np.array(accessor["max"], values.dtype))
        arrays.append(values)
    return found, arrays


def moved_by(found: dict, arrays: list[np.ndarray], node: int, path: str) -> np.ndarray | None:
    """(N, D) of a node at the times of the key frames; None for what the animation leaves as it is."""
    (animation,) = found["animations"]
    for channel in animation["channels"]:
        if channel["target"] == {"node": node, "path": path}:
            return arrays[animation["samplers"][channel["sampler"]]["output"]]
    return None


def placed(found: dict, arrays: list[np.ndarray], at_rest: bool = False) -> dict[str, np.ndarray]:
    """(N, 4, 4) from a node's axes to the scene's by its name, at the times of the key frames, or once at rest."""
    count = 1 if at_rest else len(moved_by(found, arrays, 0, "rotation"))
    places = {}

    def walk(node: int, above: np.ndarray) -> None:
        told = found["nodes"][node]
        assert set(told) <= {"name", "translation", "rotation", "children", "mesh", "skin"}
        own = np.tile(np.eye(4), (count, 1, 1))
        moves = {
            path: None if at_rest else moved_by(found, arrays, node, path)
            for path in ("translation", "rotation")
        }
        shift, turn = moves["translation"], moves["rotation"]
        own[:, :3, 3] = told.get("translation", (0, 0, 0)) if shift is None else shift
        turn = told.get("rotation", (0, 0, 0, 1)) if turn is None else turn
        own[:, :3, :3] = Rotation.from_quat(turn).as_matrix()
        places[told["name"]] = above @ own
        for child in told.get("children", ()):
            walk(child, places[told["name"]])

    for node in found["scenes"][0]["nodes"]:
        walk(node, np.tile(np.eye(4), (count, 1, 1)))
    return places


def skinned(found: dict, arrays: list[np.ndarray]) -> dict[str, np.ndarray]:
    """(N, V, 3) of the vertices that a joint turns, by its name; glTF 2.0, section 3.7.3.3, without morph targets."""
    (skin,), places = found["skins"], placed(found, arrays)
    inverse_binds = arrays[skin["inverseBindMatrices"]].reshape(-1, 4, 4).swapaxes(1, 2)
    names = [found["nodes"][joint]["name"] for joint in skin["joints"]]
    turned = {name: [] for name in names}
    for part in found["meshes"][0]["primitives"]:
        points, joints, weights = (
            arrays[part["attributes"][kind]] for kind in ("POSITION", "JOINTS_0", "WEIGHTS_0")
        )
        np.testing.assert_array_equal(weights, np.eye(1, 4).repeat(len(points), axis=0))
        for joint in np.unique(joints[:, 0]):
            rows = points[joints[:, 0] == joint]
            rows = np.concatenate([rows, np.ones((len(rows), 1))], axis=1)
            turned[names[joint]].append(rotate(places[names[joint]] @ inverse_binds[joint], rows)[..., :3])
    return {name: np.concatenate(parts, axis=1) for name, parts in turned.items() if parts}


def test_bvh_in_a_reader_of_another_package(walked, tmp_path):
    bvhio = pytest.importorskip("bvhio", reason="bvhio is not installed")
    take = walked(feet=True)
    write_bvh(take, tmp_path / "a.bvh")
    file = bvhio.readAsBvh(str(tmp_path / "a.bvh"))
    found, skeleton = armature(take), bvhio.readAsHierarchy(str(tmp_path / "a.bvh"))
    assert file.FrameTime == pytest.approx(1 / found.fps)
    assert file.FrameCount == len(found.root)
    wanted, _ = place(found.skeleton, found.root, found.R_parent_from_joint)
    joints = {joint.Name: joint for joint, _, _ in skeleton.layout()}
    assert list(joints) == list(found.skeleton.names)
    for row in (0, 50, 119):
        skeleton.loadPose(row)
        for i, name in enumerate(found.skeleton.names):
            np.testing.assert_allclose(np.array(joints[name].PositionWorld), wanted[row, i], atol=2e-5)


@pytest.mark.parametrize("names", ["joints", "mixamo"])
def test_bvh_read_again_is_the_take(walked, tmp_path, names):
    take = walked()
    write_bvh(take, tmp_path / "a.bvh", names)
    (poses,) = bvh.read(tmp_path / "a.bvh")
    wanted = evenly(take, ANIMATION)
    places = wanted.joints + (wanted.root - wanted.root[0])[:, None]
    shift = poses.joint("r_hip")[0] - places[0, wanted.names.index("r_hip")]
    for joint in (
        H36M17.joints if names == "joints" else ("r_hip", "l_knee", "r_ankle", "l_shoulder", "l_wrist")
    ):
        place_m = places[:, wanted.names.index(joint)] + shift
        np.testing.assert_allclose(poses.joint(joint), place_m, atol=2e-3, err_msg=joint)
    assert poses.fps == pytest.approx(wanted.fps)
    if names == "joints":
        assert poses.history[-1].options["derived"] == []
        assert without_made_nose(poses) is poses  # the nose that was seen goes on saying where the front is
    numbers = (tmp_path / "a.bvh").read_text().partition("Frame Time")[2].splitlines()[1:]
    angles = np.array([line.split() for line in numbers], float)[:, 3:]
    assert np.abs(np.diff(angles, axis=0)).max() < 180


def test_bvh_of_a_child_is_read_again_in_metres(tmp_path):
    child = walker(seconds=1, stature_m=1.1).poses
    take = Pipeline((Rectify("geometric"), Trajectories()))(Take("child", poses=child))
    write_bvh(take, tmp_path / "a.bvh")
    (poses,) = bvh.read(tmp_path / "a.bvh")
    thigh = np.linalg.norm(poses.joint("r_knee") - poses.joint("r_hip"), axis=-1)
    true = np.linalg.norm(child.joint("r_knee") - child.joint("r_hip"), axis=-1)
    np.testing.assert_allclose(thigh, true, atol=2e-3)


def test_glb_shows_the_take(walked, glb):
    take = walked(feet=True)
    found, arrays, _ = glb(take)
    armed = armature(take)
    wanted, _ = place(armed.skeleton, armed.root, armed.R_parent_from_joint)
    places = {name: at[:, :3, 3] for name, at in placed(found, arrays).items()}
    for i, name in enumerate(armed.skeleton.names):
        np.testing.assert_allclose(places[name], wanted[:, i], atol=1e-4, err_msg=name)
    ahead = places["r_big_toe"][-1] - places["r_heel"][-1]
    left = places["l_hip"][-1] - places["r_hip"][-1]
    assert np.cross(ahead, left)[1] > 0  # y is up: the left is left of where the feet point
    assert places["head"][-1, 1] > 1.6
    assert min(places[name][:, 1].min() for name in ("r_heel", "l_heel", "l_big_toe", "r_big_toe")) > -0.05


def test_the_skin_goes_with_the_joints(walked, glb):
    """Each bone's surface reaches from the joint that turns it to the next one, in every frame."""
    take = walked(feet=True)
    found, arrays, _ = glb(take)
    places = {name: at[:, :3, 3] for name, at in placed(found, arrays).items()}
    surfaces = skinned(found, arrays)
    for start, end in (("r_hip", "r_knee"), ("l_elbow", "l_wrist"), ("spine", "thorax"), ("pelvis", "l_hip")):
        bone = np.linalg.norm(places[end] - places[start], axis=1)
        for joint in (start, end):
            off = np.linalg.norm(surfaces[start] - places[joint][:, None], axis=2)
            np.testing.assert_allclose(off.min(axis=1), 0, atol=1e-4)
            if start != "pelvis":  # which turns two bones
                assert (off.max(axis=1) < 1.05 * bone).all()


def test_at_rest_the_armature_stands_in_the_t_pose_with_y_along_its_bones(walked, glb):
    found, arrays, _ = glb(walked(feet=True))
    places = placed(found, arrays, at_rest=True)
    (skin,) = found["skins"]
    names = [found["nodes"][joint]["name"] for joint in skin["joints"]]
    binds = arrays[skin["inverseBindMatrices"]].reshape(-1, 4, 4).swapaxes(1, 2)
    for name, bind in zip(names, binds, strict=True):
        np.testing.assert_allclose(places[name][0] @ bind, np.eye(4), atol=1e-6, err_msg=name)
    at = {name: matrix[0, :3, 3] for name, matrix in places.items()}
    y = {name: matrix[0, :3, 1] for name, matrix in places.items()}
    for start, end in (
        ("r_hip", "r_knee"), ("l_knee", "l_ankle"), ("l_clavicle", "l_shoulder"), ("r_shoulder", "r_elbow"),
        ("lower_back", "spine"), ("neck", "nose"),
    ):  # fmt: skip
        np.testing.assert_allclose(y[start], unit(at[end] - at[start]), atol=1e-6)
    np.testing.assert_allclose([y["pelvis"], y["thorax"]], [[0, 1, 0]] * 2, atol=1e-6)
    assert at["l_wrist"][0] > 0.6
    assert at["l_wrist"][1] == pytest.approx(at["l_shoulder"][1], abs=1e-6)
    assert min(point[1] for point in at.values()) == pytest.approx(0, abs=1e-6)  # the soles
    np.testing.assert_allclose(at["pelvis"][[0, 2]], 0, atol=1e-9)


def test_knees_and_elbows_bend_about_their_bones_x_axis(walked, glb):
    found, arrays, _ = glb(walked())
    names = [node["name"] for node in found["nodes"]]
    for joint in ("r_knee", "l_knee", "r_elbow", "l_elbow"):
        turns = Rotation.from_quat(moved_by(found, arrays, names.index(joint), "rotation")).as_rotvec()
        bent = np.linalg.norm(turns, axis=1) > np.radians(10)
        assert bent.any()
        assert (unit(turns[bent])[:, 0] > 0.99).all()  # and all four the same way


def test_glb_keeps_to_the_format(walked, glb):
    found, arrays, _ = glb(walked())
    assert found["asset"]["version"] == "2.0"
    said = found["asset"]["extras"]["provenance"]
    assert (said["take"], said["length_unit"]) == ("walker", "m")
    assert "x left, y up, z front" in said["axes"]
    animation = found["animations"][0]
    for sampler in animation["samplers"]:
        times, values = arrays[sampler["input"]][:, 0], arrays[sampler["output"]]
        assert times[0] == 0
        assert (np.diff(times) > 0).all()
        assert len(times) == len(values)
    targets = [(channel["target"]["node"], channel["target"]["path"]) for channel in animation["channels"]]
    assert len(set(targets)) == len(targets)
    for number, (_, path) in enumerate(targets):
        if path == "rotation":
            turns = arrays[animation["samplers"][number]["output"]]
            np.testing.assert_allclose(np.linalg.norm(turns, axis=1), 1, atol=1e-5)
            assert ((turns[1:] * turns[:-1]).sum(axis=1) > 0).all()
    children = [child for node in found["nodes"] for child in node.get("children", ())]
    assert sorted([*children, *found["scenes"][0]["nodes"]]) == list(range(len(found["nodes"])))
    assert found["skins"][0]["joints"] == list(range(len(found["nodes"]) - 2))
    (surface,) = found["meshes"][0]["primitives"]
    assert arrays[surface["indices"]].max() == len(arrays[surface["attributes"]["POSITION"]]) - 1


@pytest.mark.parametrize("gaps", [False, True])
def test_khronos_validator_finds_nothing(walked, gappy, glb, gaps):
    node = shutil.which("node")
    if not node or subprocess.run([node, "-e", "require('gltf-validator')"], capture_output=True).returncode:
        pytest.skip("the npm package gltf-validator is not where node finds it (NODE_PATH)")
    path = glb(gappy if gaps else walked(feet=True))[2]
    done = subprocess.run([node, "-e", _VALIDATE, str(path)], capture_output=True, text=True, check=True)
    report = json.loads(done.stdout)
    assert report["issues"]["messages"] == []
    assert report["info"]["hasSkins"]


def opened(command: list[str], take: Take, path: Path) -> dict:
    """What a program says of a file 2 s from its beginning."""
    done = subprocess.run([*command, str(path), "2.0"], capture_output=True, text=True, check=True)
    said = next(line for line in done.stdout.splitlines() if line.startswith("found "))
    return json.loads(said.removeprefix("found "))


def posed(take: Take) -> np.ndarray:
    """(J, 3) the joints 2 s from the beginning."""
    armed = armature(take)
    rows = slice(round(2 * armed.fps), round(2 * armed.fps) + 1)
    return place(armed.skeleton, armed.root[rows], armed.R_parent_from_joint[rows])[0][0]


@pytest.fixture(params=["Blender", "three.js"])
def program(request) -> list[str]:
    """What opens a file in that program."""
    if request.param == "Blender":
        if not find_spec("bpy"):
            pytest.skip("Blender as a Python package (bpy) is not installed")
        return [sys.executable, "-c", _OPEN_IN_BLENDER]
    node, modules = shutil.which("node"), Path(os.environ.get("NODE_PATH", ""))
    if not node or not (modules / "three").is_dir():
        pytest.skip("the npm package three is not in NODE_PATH")
    return [node, str(Path(__file__).with_name("open_in_three.mjs"))]


@pytest.mark.parametrize("write", [write_glb, write_bvh])
@pytest.mark.parametrize("names", ["joints", "mixamo"])
def test_another_program_finds_an_armature_that_moves(walked, tmp_path, program, write, names):
    take, path = walked(feet=True), tmp_path / f"skeleton.{write.__name__[-3:]}"
    write(take, path, names)
    found, bones = opened(program, take, path), armature(take, names).skeleton.names
    assert set(found["posed"]) == set(bones)
    blender = program[0] == sys.executable  # whose z is up
    for name, (x, y, z) in zip(bones, posed(take), strict=True):
        place_m = (x, -z, y) if blender else (x, y, z)
        np.testing.assert_allclose(found["posed"][name], place_m, atol=2e-3, err_msg=name)
    if blender and write == write_glb:
        assert found["modifiers"] == ["ARMATURE"]
        assert set(found["groups"]) == set(bones)
        for start, end in (("r_hip", "r_knee"), ("l_shoulder", "l_elbow")):
            of = [bones[armature(take).skeleton.names.index(joint)] for joint in (start, end)]
            np.testing.assert_allclose(found["rest"][of[0]][1], found["rest"][of[1]][0], atol=1e-3)


def test_what_was_held_is_told_in_the_summary(gappy, tmp_path):
    kinematics = {"r_wrist_x": np.zeros(len(gappy.poses))}
    take = Export(tmp_path, also=("bvh", "glb"))(gappy.with_(kinematics=kinematics))
    notices = json.loads((tmp_path / "summary.json").read_text())["notices"]
    notes = [said["text"] for said in notices if said["weight"] == "note"]
    for file in ("skeleton.bvh", "skeleton.glb"):
        assert any(f"{file}: in 15 of 116 frames nothing is known about l_elbow" in note for note in notes)
    assert [event.text for event in take.notices if event.weight == "note"] == notes


def of_rows(filtered, kept, **changes):
    """The filtered poses of those rows alone."""
    arrays = ("joints", "confidence", "time_s", "frame_index")
    path = filtered.path.each(lambda values: values[kept])
    return replace(filtered, path=path, **{name: getattr(filtered, name)[kept] for name in arrays} | changes)


def joints_of(found):
    """(N, J, 3) by the joints' names."""
    joints, _ = place(found.skeleton, found.root, found.R_parent_from_joint)
    return dict(zip(found.skeleton.names, np.moveaxis(joints, 1, 0), strict=True))


@pytest.mark.parametrize("feet", [False, True])
def test_joints_are_where_the_take_has_them(walked, feet):
    """But for the walker's soles, which bend where they meet the floor."""
    take = walked(feet)
    found, wanted = armature(take), evenly(take, ANIMATION)
    joints = joints_of(found)
    assert len(wanted.names) == (23 if feet else 17)
    for i, name in enumerate(wanted.names):
        off = 2e-3 if name in H36M17 else 0.05
        np.testing.assert_allclose(joints[name] - found.root, wanted.joints[:, i], atol=off, err_msg=name)
    over_the_floor = markers(take, ANIMATION).root
    np.testing.assert_allclose(found.root - found.root[0], over_the_floor - over_the_floor[0], atol=1e-9)


def test_bones_do_not_spin_about_themselves(walked):
    """A knee and an elbow are hinges: their rotation is the angle between their bones, and no more."""
    take = walked()
    found = armature(take)
    joints = {name: take.filtered.joint(name).astype(float) for name in H36M17.joints}
    for end, joint, start in (("ankle", "knee", "hip"), ("wrist", "elbow", "shoulder")):
        for side in "lr":
            upper = joints[f"{side}_{joint}"] - joints[f"{side}_{start}"]
            lower = joints[f"{side}_{end}"] - joints[f"{side}_{joint}"]
            cosine = (upper * lower).sum(-1) / np.linalg.norm(upper, axis=-1) / np.linalg.norm(lower, axis=-1)
            R = found.R_parent_from_joint[:, found.skeleton.names.index(f"{side}_{joint}")]
            bend = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
            np.testing.assert_allclose(geodesic_deg(R, np.eye(3)), bend, atol=1.0)
    steps = geodesic_deg(found.R_parent_from_joint[1:], found.R_parent_from_joint[:-1])
    assert steps.max() < 26  # the arms are raised by 25 degrees a frame


def test_frames_without_a_pose_are_cut_at_the_ends_and_held_between(gappy, walk):
    found = armature(gappy)
    assert len(found.root) == len(walk) - 4
    assert found.time_s[0] == pytest.approx(walk.time_s[4])
    assert found.held["pelvis"] == found.held["r_knee"] == 10
    assert found.held["l_elbow"] == 15
    assert not found.held["l_wrist"]
    elbow = found.skeleton.names.index("l_elbow")
    held = found.R_parent_from_joint[15:22, elbow]
    np.testing.assert_array_equal(held[1:6], np.repeat(held[:1], 5, axis=0))
    assert geodesic_deg(held[5], held[6]) > 0.01
    said = {event.code: event for event in found.notes("a.bvh")}
    assert "in 15 of 116 frames nothing is known about l_elbow" in said["animation-held"].text
    assert all(event.weight == "note" for event in found.notes("a.bvh"))


def test_a_straight_upper_arm_needs_no_wrist(gappy, walk):
    """A missing wrist takes the forearm, not the upper arm that ends in a known elbow."""
    found = armature(gappy)
    joints = joints_of(found)
    elbow = evenly(gappy, ANIMATION).joints[20:25, H36M17.index("l_elbow")]
    np.testing.assert_allclose((joints["l_elbow"] - found.root)[16:21], elbow, atol=2e-3)


def test_without_a_path_the_pelvis_stays_above_feet_on_the_floor(walked):
    take = walked()
    filtered = take.filtered.with_(path=None)
    found = armature(take.with_(filtered=filtered))
    assert np.ptp(found.root, axis=0).max() == 0
    assert found.root[0, 1] == pytest.approx(0.93, abs=0.03)


def test_a_limb_that_is_never_seen_is_left_out(walked):
    take = walked()
    joints = np.array(take.filtered.joints)
    joints[:, H36M17.index("r_knee")] = np.nan
    found = armature(take.with_(filtered=take.filtered.with_(joints=joints)))
    assert {"r_knee", "r_ankle"}.isdisjoint(found.skeleton.names)
    assert "l_ankle" in found.skeleton.names


@pytest.mark.parametrize("tick_s", [1e-9, 1 / 90_000, 1e-3])
def test_every_measured_row_is_kept_where_others_are_lost(walked, walk, tick_s):
    """A fifth of the frames was lost; the stamps of the rest are rounded as MP4, MPEG-TS and MKV do."""
    kept = np.union1d([0, len(walk) - 1], np.flatnonzero(np.random.default_rng(1).random(len(walk)) < 0.8))
    whole = walked()
    stamps = np.round(whole.filtered.times[kept] / tick_s) * tick_s
    part = whole.with_(filtered=of_rows(whole.filtered, kept, time_s=stamps))
    found, wanted = evenly(part, ANIMATION), evenly(whole, ANIMATION)
    np.testing.assert_allclose(found.time_s, wanted.time_s, atol=1e-3)
    np.testing.assert_array_equal(found.joints[kept], wanted.joints[kept])
    np.testing.assert_array_equal(found.root[kept], wanted.root[kept])
    lost = np.setdiff1d(np.arange(len(walk)), kept)
    assert np.isnan(found.joints[lost]).all()


def test_when_the_take_begins_is_said(walked, walk):
    assert not any(event.code == "file-begins" for event in armature(walked()).notes("a.bvh"))
    said = armature(walked(time_s=walk.time_s + 7.25)).notes("a.bvh")
    assert [event.values["begin_s"] for event in said if event.code == "file-begins"] == [7.25]


def test_what_cannot_be_animated_is_refused(walked):
    take = walked()
    with refused("needs-stage"):
        armature(take.with_(filtered=None))
    first = take.filtered
    one = type(first)(first.joints[:1], first.layout, first.frame, time_s=first.times[:1])
    with pytest.raises(InputError, match="two frames or more"):
        armature(take.with_(filtered=one))
    joints = np.array(take.filtered.joints)
    joints[:, H36M17.index("r_hip")] = np.nan
    with pytest.raises(InputError, match=r"pelvis, hips and spine .* too short to be smoothed"):
        armature(take.with_(filtered=take.filtered.with_(joints=joints)))
