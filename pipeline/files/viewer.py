"""Opening a recording in the rerun viewer, on this machine only. The viewer's own window sends no word to any other;
what its page sends, in a browser, is rerun's."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

from ..core.errors import InputError
from .names import RECORDING

_HERE = "127.0.0.1"
# The viewer sends usage data unless it believes to be in continuous integration, and asks GitHub for its newest
# version: the first is switched off so (re_analytics/src/native/pipeline.rs), the second meets a closed door.
QUIET = {"CI": "1", "HTTPS_PROXY": f"http://{_HERE}:9", "RUST_LOG": "error"}


def view(folder: Path, web: bool = False) -> None:
    """Open a run's folder, or a recording itself, and return when the viewer is closed. web: in a browser on this
    machine, until interrupted. InputError when there is no recording, or when no viewer opens."""
    # Without an address the viewer would listen to the whole network, and whoever holds its usual port would be handed
    # the recording.
    options, quiet = ["--bind", _HERE, "--port", "auto"], QUIET
    if web:
        options += ["--web-viewer", "--web-viewer-port", "0"]
        quiet = QUIET | {"RUST_LOG": "error,re_sdk::web_viewer=info"}  # says the page's address
    command = [viewer_executable(), *options, str(find_recording(folder))]
    try:
        ended = subprocess.run(command, env=os.environ | quiet)
    except KeyboardInterrupt:
        if web:
            return
        raise
    if ended.returncode:
        raise InputError("no-device", "The viewer did not open; on a machine without a screen pass --web.")


def find_recording(folder: Path) -> Path:
    """take.rrd in the folder, or the .rrd file that was named; InputError when there is none."""
    path = folder / RECORDING if folder.is_dir() else folder
    inside = sorted(run.parent.name for run in folder.glob(f"*/{RECORDING}")) if not path.exists() else []
    if inside:
        raise InputError("choose-entry", f"{folder} holds several runs; view one: {folder / inside[0]}.")
    if path.suffix != ".rrd" or not path.is_file():
        raise InputError(
            "format-unknown", f"Expected a run's folder with a {RECORDING}, or an .rrd file, got {folder}."
        )
    return path


def viewer_executable() -> str:
    """The rerun viewer that the package rerun-sdk brought; InputError when it did not."""
    import rerun_cli

    folder = Path(rerun_cli.__file__).parent
    for name in ("Rerun.app/Contents/MacOS/Rerun", "rerun.exe", "rerun"):
        if (folder / name).is_file():
            return str(folder / name)
    raise InputError("needs-package", "The rerun viewer is not installed; reinstall the package rerun-sdk.")
