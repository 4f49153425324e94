"""The command line: what a user types, reads and gets back."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from commands import APART, SCIPY, pcnet3d, recipe_of, refused, said_without, succeeded
from pcnet3d.pipeline.core.errors import refusals
from pcnet3d.pipeline.core.figures import FIGURES
from pcnet3d.pipeline.core.notices import catalogue

FILES = [
    "kinematics.parquet", "measures.csv", "poses.npz", "report.html", "strides.csv", "summary.json", "take.rrd",
]  # fmt: skip


def apart(*arguments, env=None) -> subprocess.CompletedProcess:
    """pcnet3d in a process of its own, to which an environment and the warnings of other packages belong."""
    return subprocess.run([*APART, *map(str, arguments)], capture_output=True, text=True, env=env)


@pytest.fixture
def lifted(tmp_path, facing_camera) -> Path:
    """What MotionBERT writes: the pelvis moves, and its depth is 0 in the first frame."""
    jitter = np.random.default_rng(0).normal(scale=0.002, size=(30, 17, 3))
    jitter[0, 0] = 0
    np.save(tmp_path / "X3D.npy", (facing_camera * 0.8 + [0.1, 0.1, 0] + jitter).astype(np.float32))
    return tmp_path / "X3D.npy"


def alphapose(scale: float) -> str:
    points = np.random.default_rng(0).uniform(0.1, 0.9, size=(20, 17, 3)) * [scale, scale, 1]
    same = {"category_id": 1, "score": 1, "idx": 1}
    rows = enumerate(points.reshape(20, -1).tolist())
    return json.dumps([{"image_id": f"{i}.jpg", "keypoints": row, **same} for i, row in rows])


def test_a_lifters_file_becomes_a_folder_of_results(lifted, tmp_path):
    """Without the packages and the stages that it does not need, each of which takes a while to import."""
    words = ("run", "--poses", lifted, "--fps", 30, "-o", tmp_path / "out")
    result = succeeded(said_without(SCIPY | {"av", "torch", "pcnet3d.stages.calibrate"}, *words))
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == FILES
    assert "pcnet3d view" in result.stdout
    assert "--stature" in result.stderr


LIFT = "--poses X3D.npy --fps 30"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("--fps 30", ["--poses", "--keypoints"]),
        (f"{LIFT} --set read.image_size=640x360", ["read.image_size", "leave"]),
        ("--keypoints ap.json --fps 30", ["--set read.image_size"]),
        ("--keypoints unit.json --fps 30 --set read.image_size=640x360", ["pixels"]),
        ("--poses none.npy --fps 30", ["none.npy"]),
        ("--poses X3D.npy", ["--fps"]),
        (f"{LIFT} --adapter motionbird", ["motionbird", "did you mean motionbert"]),
        (f"{LIFT} -O pixl=1", ["pixl", "did you mean pixel"]),
        (f"{LIFT} -O pixel", ["KEY=VALUE"]),
        (f"{LIFT} --camera pan", ["camera", "'pan'", "static", "moving"]),
        (f"{LIFT} --set read.gravity=0,1,0 --set read.pitch=3", ["not both"]),
        (f"{LIFT} --recipe short.toml --camera moving", ["'rectify'"]),
        (f"{LIFT} --recipe none.toml", ["none.toml"]),
        ("--poses notes.txt --fps 30", ["notes.txt", "No adapter"]),
        ("--poses cut.npy --fps 30 --adapter motionbert", ["cut.npy"]),
        (f"{LIFT} --keypoints odd.json", ["odd.json"]),
        ("video.mp4 --poses X3D.npy", ["video.mp4"]),
        ("gone.mp4 --poses X3D.npy", ["gone.mp4"]),
    ],
)
def test_bad_options_and_files_get_a_sentence_and_exit_2(lifted, tmp_path, arguments, words):
    (tmp_path / "notes.txt").write_text("not poses")
    recipe_of(tmp_path / "short.toml", "clean")
    (tmp_path / "cut.npy").write_bytes(lifted.read_bytes()[:500])
    (tmp_path / "ap.json").write_text(alphapose(scale=300))
    (tmp_path / "unit.json").write_text(alphapose(scale=1))
    (tmp_path / "odd.json").write_text('{"hello": [1, 2')
    (tmp_path / "video.mp4").write_bytes(b"\0\0\0\x18ftypmp42 and then nothing")
    before = sorted(path.name for path in tmp_path.iterdir())
    refused(pcnet3d("run", *arguments.split(), "-o", tmp_path / "out", cwd=tmp_path), *words)
    assert sorted(path.name for path in tmp_path.iterdir()) == before


@pytest.mark.parametrize("place", ["/", "."])
@pytest.mark.parametrize("command", ["demo", f"run {LIFT}"])
def test_the_current_folder_and_those_that_hold_it_are_refused_before_any_work(
    lifted, tmp_path, command, place
):
    refused(pcnet3d(*command.split(), "-o", place, cwd=tmp_path), "cannot be replaced; choose another -o")
    assert [path.name for path in tmp_path.iterdir()] == ["X3D.npy"]


def test_a_command_that_there_is_not_is_refused_with_the_nearest():
    refused(pcnet3d("runn"), "There is no command 'runn'; did you mean run")


def test_the_help_page_costs_no_heavy_import():
    said = said_without({"scipy", "cv2", "torch", "rerun", "pyarrow", "av", "onnxruntime"}, "--help").stdout
    commands = [
        line.split()[1]
        for line in said.split("Commands")[1].splitlines()
        if line[:1] == "│" and line[2:3].isalpha()
    ]
    assert {"run", "inspect", "view", "list", "batch", "compare", "live", "demo"} <= set(commands)
    assert commands[-1] == "lab"  # behind which the developers' commands stand
    assert all(flag in said for flag in ("--version", "-h", "--verbose", "--install-completion"))


def test_a_run_has_22_options_at_most_in_panels():
    from pcnet3d.pipeline.cli import load_command

    shown = [option for option in load_command("run").params if option.opts[0][0] == "-"]
    assert len(shown) <= 22  # beside --help
    assert not any(option.hidden for option in shown)
    assert {option.rich_help_panel for option in shown} == {"Input", "Person", "Camera", "Output"}
    assert all(option.help for option in shown)


def test_the_version_is_the_packages():
    from importlib.metadata import version

    assert pcnet3d("--version").stdout == f"pcnet3d {version('pcnet3d')}\n"
    as_module = [sys.executable, "-m", "pcnet3d", "--version"]
    assert subprocess.run(as_module, capture_output=True, text=True).stdout == pcnet3d("--version").stdout


def test_verbose_says_what_each_stage_is_given(lifted, tmp_path):
    recipe = recipe_of(tmp_path / "short.toml", "rectify")
    settings = ["--set", "rectify.rectifier=geometric", "--recipe", recipe, "-v"]
    result = pcnet3d("run", "--poses", lifted, "--fps", 30, *settings, "-o", tmp_path / "out")
    assert "rectify: rectifier=geometric" in result.stderr


@pytest.mark.skipif(
    os.geteuid() == 0 and not Path("/proc").exists(), reason="needs a place root cannot write"
)
def test_a_place_that_cannot_be_written_is_said(lifted):
    refused(pcnet3d("run", "--poses", lifted, "--fps", 30, "-o", "/proc/nowhere/out"), "Cannot write")


def test_a_run_ended_by_the_system_leaves_nothing(lifted, tmp_path):
    """What a cluster's scheduler sends; the image of a patient must not stay in a hidden folder."""
    np.save(lifted, np.tile(np.load(lifted), (500, 1, 1)))
    command = [*APART, "run", "-v", "--poses", str(lifted), "--adapter", "motionbert", "--fps", "30"]
    with subprocess.Popen([*command, "-o", str(tmp_path / "out")], stderr=subprocess.PIPE, text=True) as run:
        assert run.stderr is not None
        run.stderr.readline()  # what the first stage is given: the run is under way
        run.terminate()
        assert run.wait() == 143
    assert [path.name for path in tmp_path.iterdir()] == ["X3D.npy"]


@pytest.mark.parametrize(("words", "code"), [(["--version"], 0), (["inspect", "nosuch.npy"], 2)])
def test_what_aborts_while_python_takes_itself_down_changes_no_exit_code(words, code):
    asked = f"import atexit, os, sys; atexit.register(os.abort); sys.argv = ['pcnet3d', *{words}]\n"
    asked += "from pcnet3d.pipeline.cli import program; program()"
    ended = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True)
    assert (ended.returncode, bool(ended.stdout), bool(ended.stderr)) == (code, code == 0, code == 2)


def test_an_import_that_is_cut_short_is_no_fault_of_ours():
    """Packages in C answered the signal's exit with an ImportError of their own."""
    code = """
import os, signal
from pcnet3d.pipeline import cli
def app(standalone_mode):
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    except SystemExit:
        raise ImportError("initialization failed")
cli.app = app
cli.main()
"""
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert (ended.returncode, ended.stderr) == (143, "")


def test_a_name_that_the_terminal_cannot_show(lifted, tmp_path):
    odd = lifted.rename(tmp_path / "Müller.npy")
    plain = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    recipe = recipe_of(tmp_path / "short.toml", "rectify", "trajectories", "export", "report")
    command = [*APART, "run", "--poses", odd, "--fps", "30", "--recipe", recipe, "-o", tmp_path / "out"]
    result = subprocess.run(command, capture_output=True, env=plain)
    assert result.returncode == 0, result.stderr


def test_list_prints_one_line_an_adapter_and_json():
    lines = pcnet3d("list", "adapters").stdout.splitlines()
    rows = json.loads(pcnet3d("list", "adapters", "--json").stdout)
    assert [line.split(maxsplit=2) for line in lines] == [list(row.values()) for row in rows]
    assert all(list(row) == ["name", "gives", "reads"] for row in rows)
    assert {"motionbert", "json2d", "video"} <= {row["name"] for row in rows}
    keys = [figure.key for figure in FIGURES.values()]
    for what, known in (("notices", catalogue()), ("refusals", refusals()), ("figures", keys)):
        rows = json.loads(pcnet3d("list", what, "--json").stdout)
        assert [next(iter(row.values())) for row in rows] == [*known]
    stages = json.loads(pcnet3d("list", "stages", "--json").stdout)
    assert {row["name"] for row in stages} >= {"clean", "rectify"}


def test_packages_with_broken_adapters_do_not_keep_the_others_from_working(lifted, tmp_path):
    """Their folders are as installed packages': a module and the metadata with its entry point."""
    broken = {
        "gone": ("import nothing_there\n", "nothing_there"),
        "bare": ('name = "bare"\n', "it has no gives, reads, sniff, read"),
    }
    for name, (module, _) in broken.items():
        (tmp_path / "site" / f"{name}-1.0.dist-info").mkdir(parents=True)
        (tmp_path / "site" / f"{name}.py").write_text(module)
        metadata = {"METADATA": f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n"}
        metadata["entry_points.txt"] = f"[pcnet3d.adapters]\n{name} = {name}\n"
        for file, text in metadata.items():
            (tmp_path / "site" / f"{name}-1.0.dist-info" / file).write_text(text)
    beside = {**os.environ, "PYTHONPATH": str(tmp_path / "site")}

    listed = apart("list", "adapters", env=beside)
    assert listed.stdout == pcnet3d("list", "adapters").stdout
    assert listed.stderr.count("\n") == 2
    for name, (_, words) in broken.items():
        (line,) = (line for line in listed.stderr.splitlines() if f"warning: The adapter '{name}'" in line)
        assert words in line
    result = apart("inspect", lifted, env=beside)
    assert result.returncode in (0, 3), result.stderr
    assert "motionbert" in result.stdout
    named = apart("inspect", lifted, "--adapter", "bare", env=beside)
    assert named.returncode == 2
    assert "cannot be loaded" in named.stderr.splitlines()[-1]


def test_without_torch_the_laboratory_names_the_extra_to_install(tmp_path):
    """ "Repair or uninstall its package" was said of pcnet3d, and [train] was missing: rich took it for a style."""
    (tmp_path / "sitecustomize.py").write_text("import sys\n\nsys.modules['torch'] = None\n")
    without = {**os.environ, "PYTHONPATH": str(tmp_path)}
    shown = " ".join(apart("lab", "--help", env=without).stdout.replace("│", " ").split())
    assert "evaluate" in shown
    assert "pip install 'pcnet3d[train]'" in shown
    assert "uninstall" not in shown
    asked = apart("lab", "testbed", "--help", env=without)
    assert (asked.returncode, asked.stderr.count("\n")) == (2, 1)
    assert "pcnet3d[train]" in asked.stderr


def test_list_models_names_what_can_be_asked_for():
    from pcnet3d.models import load_rectifier
    from pcnet3d.models.lifter.builtin import network

    rows = {row["name"]: row for row in json.loads(pcnet3d("list", "models", "--json").stdout)}
    lines = pcnet3d("list", "models").stdout.splitlines()
    assert [line.split()[0] for line in lines] == list(rows)
    rectifiers = [name for name, row in rows.items() if row["is"] == "rectifier"]
    assert {load_rectifier(name).method.partition("@")[0] for name in rectifiers} == set(rectifiers)
    assert load_rectifier("pcnet").method.partition("@")[2] in rows["pcnet"]["what"]
    assert rows["pcnet3d"]["is"] == "lifter"
    assert network("pcnet3d").digest in rows["pcnet3d"]["what"]


def test_view_without_a_recording(tmp_path):
    refused(pcnet3d("view", tmp_path), "take.rrd")


@pytest.mark.data("native")
@pytest.mark.parametrize(
    ("poses", "keypoints", "adapter"),
    [
        ("motionbert/boxing_X3D.npy", "motionbert/boxing_alphapose-results.json", "motionbert"),
        ("motionbert/cycling_X3D.npy", None, "motionbert"),
        ("mhformer/skating", "mhformer/skating", "videopose3d"),
    ],
)
def test_real_files_go_through(data, tmp_path, poses, keypoints, adapter):
    more = ["--keypoints", data / "native" / keypoints] if keypoints else []
    result = succeeded(
        pcnet3d("run", "--poses", data / "native" / poses, *more, "--fps", 30, "-o", tmp_path / "out")
    )
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["inputs"][0]["adapter"] == adapter
    assert summary["rectification"]["level_ok"]
    assert "unusable" not in result.stdout


@pytest.mark.data("native")
def test_a_broken_real_file_is_carried_with_a_loud_warning(data, tmp_path):
    poses = data / "native" / "motionbert" / "broken_X3D.npy"
    result = succeeded(pcnet3d("run", "--poses", poses, "--fps", 25, "-o", tmp_path / "out"))
    assert "he poses are unusable. " in result.stdout
    said = json.loads((tmp_path / "out" / "summary.json").read_text())["notices"]
    assert ("bones", "unusable") in [(each["code"], each["weight"]) for each in said]
