"""`pcnet3d` as a user types it, in this process: a new one takes seconds for its imports alone."""

import contextlib
import io
import os
import signal
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

from pcnet3d.pipeline.cli import main

APART = [sys.executable, "-c", "from pcnet3d.pipeline.cli import main; main()"]  # in a process of its own
# What a run does without, for each takes a twentieth to a third of a second to import.
SCIPY = {
    f"scipy.{part}"
    for part in ("interpolate", "ndimage", "optimize", "signal", "spatial", "special", "stats")
}


def pcnet3d(
    *words: object, cwd: Path | None = None, encoding: str = "utf-8", **environment: str
) -> subprocess.CompletedProcess[str]:
    """pcnet3d("run", ...): exit code and what it said, on 80 columns as where there is no terminal."""
    argv = ["pcnet3d", *map(str, words)]
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding=encoding, write_through=True) for _ in range(2))
    terminate, code = signal.getsignal(signal.SIGTERM), 0
    with (
        patch.object(sys, "argv", argv),
        patch.dict(os.environ, {"COLUMNS": "80", **environment}),
        contextlib.chdir(cwd or "."),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
        finally:
            signal.signal(signal.SIGTERM, terminate)
    said = (stream.buffer.getvalue().decode(encoding) for stream in (out, err))
    return subprocess.CompletedProcess(argv, int(code), *said)


def said_without(heavy: set[str], *words: object) -> subprocess.CompletedProcess:
    """What a command says, in a process of its own, that imports none of these packages."""
    asked = f"import sys; sys.argv = {['pcnet3d', *map(str, words)]}\nfrom pcnet3d.pipeline.cli import main\n"
    asked += f"try: main()\nfinally: print('heavy:', *{heavy}.intersection(sys.modules))"
    done = subprocess.run([sys.executable, "-c", asked], capture_output=True, text=True)
    assert done.stdout.splitlines()[-1].strip() == "heavy:", done.stderr
    return done


def refused(result: subprocess.CompletedProcess[str], *words: object) -> None:
    """One sentence that has these words, exit code 2, no traceback."""
    assert result.returncode == 2, (result.returncode, result.stderr)
    assert "Traceback" not in result.stderr
    assert len([line for line in result.stderr.splitlines() if line.startswith("pcnet3d: ")]) == 1
    assert all(str(word) in result.stderr for word in words), result.stderr


def succeeded(result: subprocess.CompletedProcess[str]) -> subprocess.CompletedProcess[str]:
    """The same, whose exit code is 0."""
    assert result.returncode == 0, result.stderr
    return result


def recipe_of(path: Path, *stages: str) -> Path:
    """Writes a recipe of these stages as they are by default."""
    path.write_text("".join(f'[[stages]]\nuse = "{stage}"\n' for stage in stages), encoding="utf-8")
    return path
