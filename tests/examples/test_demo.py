"""The demo, run as a user runs it."""

import json
import re

import numpy as np
import pytest

from commands import SCIPY, pcnet3d, said_without, succeeded


def test_demo_leaves_inputs_and_results_and_compares_with_the_truth(tmp_path):
    output = tmp_path / "out"
    done = succeeded(pcnet3d("-v", "demo", "-o", output, encoding="cp1252"))
    assert not re.search(r"\\[ux]", done.stderr)  # what a console of Windows cannot print
    said = done.stdout
    assert {path.name for path in (tmp_path / "out-input").iterdir()} == {
        "walker.mp4", "alphapose-results.json", "X3D.npy", "summary.json",
    }  # fmt: skip
    assert {"take.rrd", "poses.npz", "kinematics.parquet", "summary.json"} <= {
        path.name for path in output.iterdir()
    }
    assert "against the truth" in said
    assert f"pcnet3d view {output}" in said
    with np.load(output / "poses.npz", allow_pickle=False) as stored:
        assert stored["body"].shape == (240, 17, 3)
        assert str(stored["unit"]) == "m"
        # Both arms up: the wrists are as far above the pelvis as they are in truth, give or take noise.
        up = stored["level"][:, list(stored["joint_names"]).index("r_wrist"), 2]
    assert up.max() == pytest.approx(1.09, abs=0.1)
    # What it says is the same by hand is the same.
    (by_hand,) = re.findall(r"the same by hand: (.*) -o DIR", said)
    words = (*by_hand.split()[1:], "-o", tmp_path / "by_hand", "--set", "record=off", "--set", "report=off")
    succeeded(said_without(SCIPY, *words))
    own, other = (
        json.loads((folder / "summary.json").read_text()) for folder in (output, tmp_path / "by_hand")
    )
    assert {key for key in own if own[key] != other[key]} == {"files"}  # the recording and the report
