"""skeleton.bvh, opened by readers that are not ours, against the take's joints."""

import json
import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from pcnet3d.adapters import bvh
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17, Pipeline, Take
from pcnet3d.pipeline.files.skeletons import place
from pcnet3d.pipeline.signals.checks import without_made_nose
from pcnet3d.stages.export.animation import ANIMATION, armature, write_bvh
from pcnet3d.stages.export.markers import evenly
from pcnet3d.stages.export.stage import Export
from pcnet3d.stages.rectify import Rectify
from pcnet3d.stages.trajectories import Trajectories

_OPEN_IN_BLENDER = """
import sys, json, bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.preferences.addon_enable(module="io_anim_bvh")
bpy.ops.import_anim.bvh(filepath=sys.argv[1], update_scene_fps=True)
(armature,) = (each for each in bpy.data.objects if each.type == "ARMATURE")
scene = bpy.context.scene
scene.frame_set(1 + int(float(sys.argv[2]) * scene.render.fps))  # frames count from 1
print("found", json.dumps({
    each.name: list(armature.matrix_world @ each.head) for each in armature.pose.bones
}))
"""


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


@pytest.mark.parametrize("names", ["joints", "mixamo"])
def test_another_program_finds_an_armature_that_moves(walked, tmp_path, program, names):
    take, path = walked(feet=True), tmp_path / "skeleton.bvh"
    write_bvh(take, path, names)
    found, bones = opened(program, take, path), armature(take, names).skeleton.names
    assert set(found) == set(bones)
    blender = program[0] == sys.executable  # whose z is up
    for name, (x, y, z) in zip(bones, posed(take), strict=True):
        place_m = (x, -z, y) if blender else (x, y, z)
        np.testing.assert_allclose(found[name], place_m, atol=2e-3, err_msg=name)


def test_what_was_held_is_told_in_the_summary(gappy, tmp_path):
    kinematics = {"r_wrist_x": np.zeros(len(gappy.poses))}
    take = Export(tmp_path, also=("bvh",))(gappy.with_(kinematics=kinematics))
    notices = json.loads((tmp_path / "summary.json").read_text())["notices"]
    notes = [said["text"] for said in notices if said["weight"] == "note"]
    assert any("skeleton.bvh: in 15 of 116 frames nothing is known about l_elbow" in note for note in notes)
    assert [event.text for event in take.notices if event.weight == "note"] == notes
