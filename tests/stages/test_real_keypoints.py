"""Keypoints of real videos: exchanged legs to the frame, knees outside of the image, steps that nobody took."""

import json
import re

import numpy as np
import pytest

from commands import pcnet3d, recipe_of, succeeded
from golden.detections import coco_tracks

pytestmark = pytest.mark.data("lifter")
EXCHANGED = {
    43,
    62,
    65,
    66,
    67,
    95,
    96,
}  # the frames of walk_crop in which MoveNet exchanges the legs, by eye
LEGS = ((13, 14), (15, 16), (11, 12))  # left and right of COCO's hips, knees and ankles


@pytest.fixture
def run(data, tmp_path):
    """run(clip, words, change): summary.json of a run on MoveNet's keypoints of a clip, which change(points) spoils."""
    stages = ("lift", "clean", "rectify", "trajectories", "angles", "measures", "export")
    short = recipe_of(tmp_path / "short.toml", *stages)

    def of(clip, *words, change=lambda points: None):
        points = np.load(data / f"lifter/{clip}.npz")["movenet_kp2d"].astype(float)
        change(points)
        keypoints = coco_tracks(tmp_path, {"0": (np.arange(len(points)), points)})
        succeeded(pcnet3d("run", *words, "--keypoints", keypoints, "--recipe", short, "-o", tmp_path / "out"))
        return json.loads((tmp_path / "out" / "summary.json").read_text())

    return of


def exchanged(summary) -> set[int]:
    """The frames in which legs, or their joints, are said to be exchanged."""
    said = " ".join(each["text"] for each in summary["notices"] if "exchanged" in each["text"])
    said = re.sub(r" (at|from) [\d.]+ s", "", said)
    return {
        frame
        for listed in re.findall(r"(?:legs|knees|ankles) exchanged in frames? ([-, 0-9]+)", said)
        for first, last in re.findall(r"(\d+)(?:-(\d+))?", listed)
        for frame in range(int(first), int(last or first) + 1)
    }


@pytest.mark.parametrize("frames", [(), (43, 65, 95)])
def test_legs_are_exchanged_where_they_are(run, frames):
    """As the network has them, and with three frames changed: of the frames that are told each is exchanged, or next to
    one that is; or of a run that was cut in two, the part that is put right."""

    def change(points):
        for left, right in LEGS:
            points[np.ix_(frames, [left, right])] = points[np.ix_(frames, [right, left])]

    found = exchanged(run("walk_crop", "--fps", 30, "--set", "read.image_size=884x300", change=change))
    there = EXCHANGED - {43} if frames else EXCHANGED
    assert found
    assert found <= {frame + off for frame in there for off in (-1, 0, 1)}
    assert frames or found >= EXCHANGED


def test_knees_outside_of_the_image_have_no_range(run, data):
    """The image is said to end a little below the hips."""
    hips = np.load(data / "lifter/walk_crop.npz")["movenet_kp2d"][:, 11:13, 1]
    size = f"read.image_size=884x{int(np.median(hips)) + 5}"
    summary = run("walk_crop", "--fps", 30, "--set", size)
    assert "not in the image" in [each["values"].get("how") for each in summary["notices"]]
    ranges = summary["measures"]["range_of_motion"]
    assert not any("p05_p95_deg" in ranges[f"{side}_knee_flexion"] for side in "rl")


def test_steps_are_counted_behind_the_third_second_only(run):
    """The man of demo_man stands before he walks."""
    summary = run("demo_man", "--fps", 30, "--set", "read.image_size=1768x994")
    walking = summary["measures"]["walking"]
    sides = [walking.get(side, {}) for side in ("right", "left")]
    assert all(time_s > 3 for side in sides for time_s in side.get("landings_s", ()))
    assert "cadence_spm" not in walking or sum(side.get("strides", 0) for side in sides) >= 3
