"""That `loaded.py` counts what a command's options pass through, and says why a command failed."""

import os
import subprocess
import sys
from pathlib import Path

TESTS = Path(__file__).parents[1]


def counted(*words: object) -> subprocess.CompletedProcess[str]:
    """`functions_given_options` in a process of its own, because it runs the command line in its own."""
    code = "import sys; from replay.loaded import *; print(sorted(functions_given_options(sys.argv[1:])))"
    environment = os.environ | {"PYTHONPATH": str(TESTS)}
    command = [sys.executable, "-c", code, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, env=environment, check=False)


def test_functions_that_the_options_pass_through(facing_camera, save, tmp_path):
    poses = save(facing_camera[None].repeat(30, axis=0))
    words = ["run", "--poses", poses, "--fps", 30, "--adapter", "arrays"]
    words += [
        "-O",
        "layout=H36M17",
        "-O",
        "frame=CAMERA",
        "-O",
        "unit=m",
        "--set",
        "record=off",
        "--set",
        "report=off",
    ]
    ended = counted(*words, "-o", tmp_path / "out")
    assert ended.returncode == 0, ended.stderr
    assert "pipeline/running/run.py:run_files" in ended.stdout


def test_a_command_that_fails_says_why(tmp_path):
    """It once ended with an exit code and no word."""
    ended = counted("run", tmp_path / "nowhere.mp4", "-o", tmp_path / "out")
    assert ended.returncode == 1
    assert "nowhere.mp4" in ended.stderr
