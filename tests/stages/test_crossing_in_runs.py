"""Two people who cross before one camera, the far one hidden meanwhile, found by a detector without tracking."""

import numpy as np
import pytest

from golden import detections
from pcnet3d.examples.walker.camera import aimed
from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.core.layouts import HALPE26, OPENPOSE18
from pcnet3d.pipeline.core.measures import nested
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import planned
from pcnet3d.pipeline.running.run import run_people

TURN_ROUND = np.diag([-1.0, -1.0, 1.0])


@pytest.fixture(scope="module")
def crossing(tmp_path_factory):
    """(takes of both, pixels (T, 2) of both's hips, rows in which the far one is hidden)."""
    folder = tmp_path_factory.mktemp("crossing")
    near, far = walker(seconds=7, turn_deg=0), walker(seconds=7, turn_deg=0, stature_m=1.65)
    floor = np.array([1.0, 1.0, 0.0])
    middle = (near.root[0] + near.root[-1]) / 2
    camera = aimed(middle, 7, heading_deg=90, pitch_deg=5, roll_deg=0)
    behind = middle * floor + (0.6, 1.0, 0.0)
    opposite = (halpe26(far) - far.root.mean(axis=0) * floor) @ TURN_ROUND + behind
    rng = np.random.default_rng(0)
    scale = 1920 / camera.width
    people = [scale * camera.project(points) for points in (halpe26(near), opposite)]
    people = [points + rng.normal(0, 2, points.shape) for points in people]
    hips = [points[:, HALPE26.index("pelvis")] for points in people]
    hidden = np.abs(hips[0] - hips[1])[:, 0] < 150
    listed = {}
    for name, points, rows in (
        ("near", people[0], np.arange(len(near))),
        ("far", people[1], np.flatnonzero(~hidden)),
    ):
        seen = points[rows][:, HALPE26.indices(OPENPOSE18.joints)]
        listed[name] = rows, np.concatenate([seen, rng.uniform(0.8, 0.95, (*seen.shape[:2], 1))], axis=-1)
    given = RunOptions(
        keypoints=detections.openpose(folder, listed),
        fps=30,
        everyone=True,
        image_size="1920x1080",
        focal=scale * camera.focal_px,
        settings={"record": "off", "report": "off"},
    )
    takes = [run.take for run in run_people(given, folder / "out", planned(given))]
    return takes, hips, np.flatnonzero(hidden)


def test_everybody_stays_who_they_are(crossing):
    takes, hips, _ = crossing
    assert len(takes) == 2
    for take, own in zip(takes, hips, strict=True):
        seen = take.keypoints
        found = seen.joints[:, seen.layout.indices(["l_hip", "r_hip"])].mean(axis=1)
        assert np.nanmax(np.linalg.norm(found - own[seen.frame_index], axis=1)) < 30


def test_who_is_hidden_is_a_gap_with_its_reason(crossing):
    (near, far), _, hidden = crossing
    assert 5 < len(hidden) < 30
    assert np.isfinite(near.poses.joints).all()
    missing = ~np.isfinite(far.poses.joints).all(axis=(1, 2))
    np.testing.assert_array_equal(np.flatnonzero(missing), hidden)
    said = " ".join(event.text for event in far.notices)
    assert f"{len(hidden)} frames that the estimator dropped were put back as gaps" in said
    assert f"in {210 - len(hidden)} of 210 frames" in said  # is the path known


def test_no_step_lies_in_the_gap(crossing):
    takes, _, hidden = crossing
    walking = [nested(take.measures)["walking"] for take in takes]
    assert walking[0]["gait"] == "walking"
    assert walking[0]["steps"] >= 3
    far = walking[1]
    landed = [time for side in ("right", "left") for time in far.get(side, {}).get("landings_s", ())]
    assert not any(hidden[0] <= 30 * time <= hidden[-1] for time in landed)
    assert far.get("steps_at_least", "steps" not in far)
