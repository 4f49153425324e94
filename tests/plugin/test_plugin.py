"""The template of a third party's package: installed beside pcnet3d into a fresh environment, tested and used there."""

import json
import os
import shutil
import subprocess
import sys
import venv
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet
import pytest

from pcnet3d.examples.walker.camera import camera_poses, side_camera
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline import H36M17

ROOT = Path(__file__).parents[2]
TEMPLATE = ROOT / "examples" / "plugin"


def run(*command, cwd=None) -> str:
    """What it prints, with nothing of this environment but what the fresh one was given."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith(("PYTHON", "PIP_"))}
    result = subprocess.run([*map(str, command)], capture_output=True, text=True, cwd=cwd, env=clean)
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def fresh(wheel, tmp_path_factory) -> Path:
    """The folder of an environment's programs, in which pcnet3d and the template are installed as users do it.

    What they depend on is not installed again: packages of this environment can be seen from the fresh one.
    """
    folder = tmp_path_factory.mktemp("fresh")
    venv.create(folder / "env", with_pip=False)
    programs = folder / "env" / ("Scripts" if os.name == "nt" else "bin")
    python = programs / "python"
    site = Path(run(python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))").strip())
    (site / "zz_dependencies.pth").write_text(
        "\n".join(p for p in sys.path if p.endswith("-packages")) + "\n"
    )

    sources = folder / "sources"  # a build leaves files beside what it builds
    skipped = shutil.ignore_patterns("__pycache__", "*.egg-info", "build")
    shutil.copytree(TEMPLATE, sources / "plugin", ignore=skipped)
    offline = ("--no-deps", "--no-build-isolation", "--no-index", "--quiet")
    run(sys.executable, "-m", "pip", "--python", python, "install", *offline, wheel, sources / "plugin")
    assert run(python, "-c", "import pcnet3d.pipeline as p; print(p.__file__)").startswith(str(site))
    return programs


def test_its_own_tests_pass(fresh, tmp_path):
    shutil.copytree(TEMPLATE / "tests", tmp_path / "tests")
    assert "passed" in run(
        fresh / "python", "-m", "pytest", "-q", "-p", "no:cacheprovider", tmp_path, cwd=tmp_path
    )


def test_it_is_listed_beside_ours(fresh):
    rows = {row["name"]: row for row in json.loads(run(fresh / "pcnet3d", "list", "adapters", "--json"))}
    assert {"acme", "motionbert"} <= rows.keys()
    assert rows["acme"]["gives"] == "poses"
    code = "from pcnet3d.pipeline.plugins.registry import listed\n"
    code += "print(*(row['name'] for what in ('stages', 'writers', 'models') for row in listed(what)))"
    assert {"reach", "paths", "cardboard"} <= set(run(fresh / "python", "-c", code).split())


def test_a_run_reads_by_its_adapter_goes_through_its_stage_and_ends_with_its_writer(fresh, tmp_path):
    """The file is recognised by its content, and the file's own times are used."""
    walk = walker(seconds=4)
    joints = camera_poses(walk, side_camera(walk)).joints
    rows = np.column_stack([walk.time_s, (1000 * joints * [1, -1, -1]).reshape(len(walk), -1)])
    header = ["time_s", *(f"{joint}_{axis}" for joint in H36M17.joints for axis in "xyz")]
    exported = tmp_path / "poses.csv"  # Acme's
    np.savetxt(exported, rows, fmt="%.4f", delimiter=",", header=",".join(header), comments="")
    recipe = TEMPLATE / "recipe.toml"
    run(
        fresh / "pcnet3d",
        "run",
        "--poses",
        exported,
        "--recipe",
        recipe,
        "--also",
        "paths",
        "-o",
        tmp_path / "out",
    )
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["inputs"][0]["adapter"] == "acme"
    columns = parquet.read_table(tmp_path / "out" / "kinematics.parquet")
    reach_m = columns["r_reach_distance"].to_numpy()
    with np.load(tmp_path / "out" / "poses.npz") as file:
        level = file["level"]
    wrist, shoulder = (level[:, H36M17.index(f"r_{joint}")] for joint in ("wrist", "shoulder"))
    assert columns.schema.field("r_reach_distance").metadata == {b"unit": b"m"}
    np.testing.assert_allclose(reach_m, np.linalg.norm(wrist - shoulder, axis=-1), atol=0.03)
    assert "l_reach_distance" not in columns.column_names
    paths = json.loads((tmp_path / "out" / "paths.json").read_text())["paths"]
    np.testing.assert_allclose(paths["r_wrist"], wrist, atol=1e-6)
