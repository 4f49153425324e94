"""skeleton.bvh and skeleton.glb, opened by readers that are not ours, against the take's joints."""

import json
import struct

import numpy as np
import pytest

from pcnet3d.adapters import bvh
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.files.skeletons import place
from pcnet3d.pipeline.rotations import rotate
from pcnet3d.stages.export.armature import ANIMATION, armature
from pcnet3d.stages.export.bvh import write_bvh
from pcnet3d.stages.export.glb import write_glb
from pcnet3d.stages.export.markers import evenly
from pcnet3d.stages.export.stage import Export

_NUMBERS = {5123: np.uint16, 5126: np.float32}
_WIDTHS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


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
    for accessor in found["accessors"]:
        view = found["bufferViews"][accessor["bufferView"]]
        part = data[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        values = np.frombuffer(part, _NUMBERS[accessor["componentType"]])
        values = values.reshape(accessor["count"], _WIDTHS[accessor["type"]])
        assert view["byteOffset"] % 4 == 0
        np.testing.assert_array_equal(values.min(axis=0), np.array(accessor["min"], values.dtype))
        np.testing.assert_array_equal(values.max(axis=0), np.array(accessor["max"], values.dtype))
        arrays.append(values)
    return found, arrays


def animated(found: dict, arrays: list[np.ndarray]) -> dict[str, np.ndarray]:
    """(N, 3) of every node in the world, by name: what a viewer shows at the times of the key frames."""
    from scipy.spatial.transform import Rotation

    animation = found["animations"][0]
    moves = {
        (channel["target"]["node"], channel["target"]["path"]): arrays[
            animation["samplers"][channel["sampler"]]["output"]
        ]
        for channel in animation["channels"]
    }
    count, places = len(moves[0, "translation"]), {}

    def walk(node: int, at: np.ndarray, R: np.ndarray) -> None:
        told = found["nodes"][node]
        offset = moves.get((node, "translation"), np.tile(told.get("translation", (0, 0, 0)), (count, 1)))
        at = at + rotate(R, offset[:, None])[:, 0]
        places[told["name"]] = at
        if (node, "rotation") in moves:
            R = R @ Rotation.from_quat(moves[node, "rotation"]).as_matrix()
        for child in told.get("children", ()):
            walk(child, at, R)

    walk(found["scenes"][0]["nodes"][0], np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)))
    return places


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


def test_bvh_read_again_is_the_take(walked, tmp_path):
    take = walked()
    write_bvh(take, tmp_path / "a.bvh")
    (poses,) = bvh.read(tmp_path / "a.bvh")
    wanted, moved = evenly(take, ANIMATION), armature(take).moved
    places = wanted.joints + wanted.root[:, None] - moved
    order = [wanted.names.index(joint) for joint in H36M17.joints]
    np.testing.assert_allclose(poses.joints, places[:, order], atol=2e-3)
    assert poses.fps == pytest.approx(wanted.fps)


def test_bvh_angles_do_not_jump(walked, tmp_path):
    write_bvh(walked(), tmp_path / "a.bvh")
    numbers = (tmp_path / "a.bvh").read_text().partition("Frame Time")[2].splitlines()[1:]
    angles = np.array([line.split() for line in numbers], float)[:, 3:]
    assert np.abs(np.diff(angles, axis=0)).max() < 180


def test_glb_shows_the_take(walked, glb):
    take = walked(feet=True)
    found, arrays, _ = glb(take)
    armed = armature(take)
    wanted, _ = place(armed.skeleton, armed.root, armed.R_parent_from_joint)
    places = animated(found, arrays)
    for i, name in enumerate(armed.skeleton.names):
        np.testing.assert_allclose(places[name], wanted[:, i], atol=1e-4, err_msg=name)
    ahead = places["r_big_toe"][-1] - places["r_heel"][-1]
    left = places["l_hip"][-1] - places["r_hip"][-1]
    assert np.cross(ahead, left)[1] > 0  # y is up: the left is left of where the feet point
    assert places["head"][-1, 1] > 1.6
    assert min(places[name][:, 1].min() for name in ("r_heel", "l_heel", "l_big_toe", "r_big_toe")) > -0.05


def test_glb_keeps_to_the_format(walked, glb):
    found, arrays, _ = glb(walked())
    assert found["asset"]["version"] == "2.0"
    assert found["asset"]["extras"]["length_unit"] == "m"
    assert found["asset"]["extras"]["provenance"]["take"] == "walker"
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
    assert sorted(children) == list(range(1, len(found["nodes"])))
    for mesh in found["meshes"]:
        (surface,) = mesh["primitives"]
        assert arrays[surface["indices"]].max() < len(arrays[surface["attributes"]["POSITION"]])


def test_a_viewer_of_another_package_finds_bones_that_are_closed_and_right_side_out(walked, glb):
    trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed")
    scene = trimesh.load(glb(walked())[2])
    assert len(scene.geometry) == 16
    for bone in scene.geometry.values():
        assert bone.is_watertight
        assert bone.volume > 0
    low, high = scene.bounds
    assert high[0] - low[0] == pytest.approx(1.55, abs=0.05)  # from hand to hand of the T-pose
    assert high[1] == pytest.approx(1.7, abs=0.05)


def test_a_bone_that_nobody_saw_has_no_size(gappy, glb):
    found, arrays, _ = glb(gappy)
    animation = found["animations"][0]
    sizes = {
        found["nodes"][channel["target"]["node"]]["name"]: animation["samplers"][channel["sampler"]]
        for channel in animation["channels"]
        if channel["target"]["path"] == "scale"
    }
    assert len(sizes) == 16  # all of them in the ten frames without anything
    sampler = sizes["l_elbow to l_wrist"]
    assert sampler["interpolation"] == "STEP"
    np.testing.assert_allclose(arrays[sampler["input"]][:, 0], np.array([0, 16, 21, 56, 66]) / 30, atol=1e-5)
    assert arrays[sampler["output"]][:, 0].tolist() == [1, 0, 1, 0, 1]
    assert arrays[sizes["r_knee to r_ankle"]["output"]][:, 0].tolist() == [1, 0, 1]


def test_what_was_held_is_told_in_the_summary(gappy, tmp_path):
    kinematics = {"r_wrist_x": np.zeros(len(gappy.poses))}
    take = Export(tmp_path, also=("bvh", "glb"))(gappy.with_(kinematics=kinematics))
    notes = json.loads((tmp_path / "summary.json").read_text())["notes"]
    for file in ("skeleton.bvh", "skeleton.glb"):
        assert any(f"{file}: in 15 of 116 frames nothing is known of l_elbow" in note for note in notes)
    assert [event.text for event in take.events if event.kind == "note"] == notes


def test_lengths_without_a_scale_are_told(walked, glb, tmp_path):
    take = walked()
    filtered = take.filtered.with_(frame=take.filtered.frame.with_(unit="arbitrary"))
    take = take.with_(filtered=filtered)
    assert glb(take)[0]["asset"]["extras"]["length_unit"] == "arbitrary"
    assert any("no scale" in event.text for event in write_bvh(take, tmp_path / "a.bvh"))
