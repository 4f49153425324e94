"""Whether the tests catch 37 faults, one or two in each part of the package:  python tests/faults.py [WORD...]

Each fault is put into a copy of the files, the tests named beside it run there, and it counts as caught when one of
them fails. Exit code 1: a fault was not caught, a test fails without one, or the text to change is gone. With words,
only the faults of files whose path has one of them.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]


class Fault(NamedTuple):
    """A file, a text in it that is there once, what takes its place, and the tests that have to fail then."""

    file: str
    old: str
    new: str
    tests: str


FAULTS = [
    Fault("pipeline/core/rotations.py", "np.sign(np.linalg.det(u) * np.linalg.det(vt))", "1.0",
          "pipeline/core/test_frames.py"),
    Fault("pipeline/core/conversions.py", "matrix = to.basis @ source.basis.T", "matrix = source.basis @ to.basis.T",
          "pipeline/core/test_frames.py"),
    Fault("models/common/canonical.py", "from_columns(-np.cross(left, up), -left, up)",
          "from_columns(np.cross(left, up), left, up)", "models/common/test_canonical.py"),
    Fault("pipeline/core/camera.py", "np.arctan2(-z, np.hypot(x, y))", "np.arctan2(z, np.hypot(x, y))",
          "models/gravity/test_lines.py"),
    Fault("pipeline/signals/filters.py", "jumps = holes(time_s, BRIDGED_S)", "jumps = holes(time_s, np.inf)",
          "pipeline/signals/test_filters.py"),
    Fault("pipeline/reading/people.py", 'REACH = limit("tracks.reach")', "REACH = 5.0",
          "pipeline/reading/test_people.py"),
    Fault("pipeline/signals/visibility.py", "((points <= border_px) | (points >= high))", "(points >= high)",
          "pipeline/signals/test_visibility.py"),
    Fault("stages/clean.py", 'f"{joint[:2]}ankle" if joint in FEET', 'joint if joint in FEET',
          "pipeline/core/test_feet.py"),
    Fault("pipeline/reading/people.py", "value == max(values)", "value == min(values)",
          "pipeline/running/test_choosing.py"),
    Fault("pipeline/reading/take.py", 'np.searchsorted(time_s, end, "right")', "np.searchsorted(time_s, end)",
          "pipeline/reading/test_time_range.py"),
    Fault("pipeline/files/markers.py", '["+Y"] else "z"', '["-Y"] else "z"', "adapters/test_mocap_files.py"),
    Fault("pipeline/files/atomic.py", "if used.resolve().is_relative_to(path):", "if used.resolve() == path:",
          "pipeline/files/test_outputs.py"),
    Fault("pipeline/plugins/options.py", 'value.split(",")', 'value.split(";")', "pipeline/running/test_settings.py"),
    Fault("pipeline/running/recipe.py", '"calibrate": options.video is not None', '"calibrate": False',
          "pipeline/running/test_settings.py"),
    Fault("pipeline/running/recipe.py", "*self.stages))", "*self.stages[1:]))", "pipeline/running/test_settings.py"),
    Fault("pipeline/reading/together.py", "* rate + lag", "* rate - lag", "pipeline/reading/test_together.py"),
    Fault("adapters/kit/people.py", "self.points[self.scores == 0] = np.nan", "self.points[self.scores == 1] = np.nan",
          "adapters/keypoints/test_json2d.py"),
    Fault("adapters/kit/clock.py", "np.rint(steps / usual)", "np.ones(len(steps))", "adapters/test_mediapipe.py"),
    Fault("models/lab/cases.py", 'if per == "frame"', 'if per == "take"', "models/lab/test_cases.py"),
    Fault("models/smoother.py", "np.square(factors)[:, None", "np.array(factors)[:, None",
          "models/test_smoother.py::test_factors_are_of_standard_deviations"),
    Fault("models/detector/scene_cuts.py", ">= _STAYS", "< _STAYS", "models/detector/test_scene_cuts.py"),
    Fault("models/rectifier/load.py", "np.cross(shoulders, trunk)", "np.cross(trunk, shoulders)",
          "stages/test_geometric.py"),
    Fault("models/lifter/load.py", "1.0, confidence), 0.0)", "1.0, confidence), 1.0)",
          "pipeline/running/test_process.py::test_missing_joints_reach_a_function_on_a_line_without_a_score"),
    Fault("models/lifter/otherwise.py", "joints=keypoints.joints[:, order]", "joints=keypoints.joints",
          "models/lifter/test_otherwise.py"),
    Fault("models/place/path.py", "path * stature)", "path)", "models/place/test_pelvis_path.py"),
    Fault("models/gravity/evidence.py", "odds_image > odds_bodies", "odds_image < odds_bodies",
          "models/gravity/test_gravity.py"),
    Fault("models/gravity/votes.py", "> np.sin(np.radians(_STEEP_DEG))", "> 1", "models/gravity/test_floor.py"),
    Fault("models/lab/clips.py", "combinations(PARTS, 2)", "combinations(PARTS[1:], 2)",
          "models/lab/test_clips.py"),
    Fault("models/lab/synthetic.py", "needed.amax(dim=(1, 2))", "needed.mean(dim=(1, 2))",
          "models/lab/test_synthetic.py"),
    Fault("models/lifter/features.py", "HALF_WINDOW + 1", "HALF_WINDOW",
          "models/lifter/test_lifter.py"),
    Fault("stages/scale.py", "replace(rectified, level=level, ", "replace(rectified, ",
          "stages/test_scale.py"),
    Fault("stages/measures/jumps.py", "GRAVITY / 8", "GRAVITY / 4",
          "models/place/test_airborne.py::test_rebounds_have_the_time_on_the_floor_between"),
    Fault("stages/export/markers.py", "root - height * up", "root + height * up",
          "stages/export/test_exports.py"),
    Fault("stages/report/trust.py", "min(_LEVELS.index(level)", "max(_LEVELS.index(level)",
          "stages/report/test_trust.py"),
    Fault("stages/record/stage.py", "append=last + 1) > usual", "append=last + 1) > 2 * usual",
          "stages/record/test_recording_angles.py"),
    Fault("pipeline/core/rotations.py", "np.vdot(a, b)", "np.vdot(b, a)",
          "stages/study/compare/test_compare_command.py::test_heading_and_size_are_found"),
    Fault("stages/study/compare/imu.py", "turn_deg(*reversed(", "turn_deg(*tuple(",
          "stages/study/compare/test_compare_imu.py::test_lag_and_heading_of_the_walker"),
]  # fmt: skip


def main(words: list[str]) -> int:
    chosen = [fault for fault in FAULTS if not words or any(word in fault.file for word in words)]
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "pcnet3d"
        listed = subprocess.run(
            ["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True
        )
        for name in filter(None, listed.stdout.split("\0")):
            if (ROOT / name).is_file():  # some were removed and not yet committed
                (copy / name).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(ROOT / name, copy / name)
        sound = sorted({test for fault in chosen for test in fault.tests.split()})
        code, last = run(copy, sound)
        if code:
            print(f"without a fault: {last}")
            return 1
        missed = 0
        for fault in chosen:
            missed += not caught(copy, fault)
    print(f"{len(chosen) - missed} of {len(chosen)} caught")
    return int(missed > 0)


def caught(copy: Path, fault: Fault) -> bool:
    """Whether a test fails with this fault; said on the screen with the first test that does."""
    path = copy / fault.file
    text = path.read_text(encoding="utf-8")
    if text.count(fault.old) != 1:
        print(f"not there once   {fault.file}: {fault.old}", flush=True)
        return False
    path.write_text(text.replace(fault.old, fault.new), encoding="utf-8")
    try:
        code, last = run(copy, fault.tests.split())
    finally:
        path.write_text(text, encoding="utf-8")
    print(f"{'caught    ' if code == 1 else 'not caught'} {fault.file}: {last}", flush=True)
    return code == 1  # others mean that pytest could not run the tests


def run(copy: Path, tests: list[str]) -> tuple[int, str]:
    """The exit code of these tests in the copy, and the first that failed or the last line of the output."""
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider"]
    given = os.environ | {"PYTHONPATH": str(copy.parent), "PYTHONDONTWRITEBYTECODE": "1"}
    done = subprocess.run(
        [*command, *(f"tests/{test}" for test in tests)], cwd=copy, env=given, capture_output=True, text=True
    )
    lines = done.stdout.strip().splitlines()
    failed = [line.split(" - ")[0] for line in lines if line.startswith(("FAILED", "ERROR"))]
    return done.returncode, (failed or lines[-1:] or [done.stderr.strip()])[0]


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
