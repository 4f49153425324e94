"""Every block of docs/ways-in.md works as it is written."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pcnet3d.examples.camera import side_camera
from pcnet3d.examples.files import write_keypoints, write_poses
from pcnet3d.examples.walker import walker

PAGE = Path(__file__).parents[2] / "docs" / "ways-in.md"
BLOCKS = re.findall(r"```(sh|python)\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
COMMANDS = [line for kind, block in BLOCKS if kind == "sh" for line in block.strip().splitlines()]


@pytest.fixture(scope="module")
def folder(numbered_film, toy_detector, tmp_path_factory) -> Path:
    """The files that the page speaks of, of one take of the walker."""
    folder = tmp_path_factory.mktemp("ways")
    walk, rng, rows = walker(seconds=2), np.random.default_rng(0), np.arange(60)
    write_keypoints(folder / "alphapose-results.json", walk, side_camera(walk), rows, 1.0, rng)
    write_poses(folder / "X3D.npy", walk, side_camera(walk), rows, 0.008, rng)
    for name in ("video.mp4", "stream.ts"):
        shutil.copy(numbered_film, folder / name)
    shutil.copy(toy_detector, folder / "movenet.onnx")
    return folder


def test_the_page_has_a_block_for_every_way():
    assert len(COMMANDS) == 6
    assert [kind for kind, _ in BLOCKS].count("python") == 1


@pytest.mark.parametrize("command", COMMANDS)
def test_command_of_the_page(command, folder):
    assert command.startswith("pcnet3d ")
    program = f'"{sys.executable}" -c "from pcnet3d.pipeline.cli import main; main()"'
    done = subprocess.run(
        program + command.removeprefix("pcnet3d"), shell=True, cwd=folder, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    output = folder / re.findall(r"-o (\S+)", command)[0]
    assert {"take.rrd", "poses.npz", "report.html"} <= {path.name for path in output.iterdir()}
    with np.load(output / "poses.npz") as poses:
        assert len(poses["frame_index"]) == 60


@pytest.mark.parametrize("code", [block for kind, block in BLOCKS if kind == "python"])
def test_code_of_the_page(code, folder):
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "nan" not in done.stdout
