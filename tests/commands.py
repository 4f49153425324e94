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


def pcnet3d(*words: object, cwd: Path | None = None, **environment: str) -> subprocess.CompletedProcess[str]:
    """pcnet3d("run", ...): exit code and what it said, on 80 columns as where there is no terminal."""
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    argv, terminate, code = ["pcnet3d", *map(str, words)], signal.getsignal(signal.SIGTERM), 0
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
    said = (stream.buffer.getvalue().decode() for stream in (out, err))
    return subprocess.CompletedProcess(argv, int(code), *said)
