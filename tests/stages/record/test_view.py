"""`pcnet3d view` finds the recording, and shows it on this machine alone."""

import pytest

from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.viewer import view, viewer_executable


@pytest.fixture
def run_folder(tmp_path):
    (tmp_path / "take.rrd").write_bytes(b"RRF2 some bytes")
    return tmp_path


@pytest.mark.parametrize("web", [False, True])
def test_viewer_is_started_for_this_machine_only_and_silent(run_folder, monkeypatch, web):
    started = {}

    def run(command, env):
        started.update(command=command, env=env)
        return type("Ended", (), {"returncode": 0})

    monkeypatch.setattr("subprocess.run", run)
    view(run_folder / "take.rrd" if web else run_folder, web)
    command = started["command"]
    assert ("--web-viewer" in command) == web
    assert command[0] == viewer_executable()
    assert command[command.index("--bind") + 1] == "127.0.0.1"
    assert command[-1] == str(run_folder / "take.rrd")
    assert started["env"]["CI"] == "1"


def test_viewer_that_does_not_open(run_folder, monkeypatch):
    monkeypatch.setattr("subprocess.run", lambda *_, **__: type("Ended", (), {"returncode": 1}))
    with pytest.raises(InputError, match="--web"):
        view(run_folder)
