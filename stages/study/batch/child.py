"""A worker process: runs one take after another as `pcnet3d run` would, and exits when its parent dies."""

from __future__ import annotations

import json
import os
import signal
import sys
import threading
import time
from io import FileIO
from queue import Empty, SimpleQueue
from typing import Any

from ....pipeline.cli import main
from ....pipeline.core.errors import InputError
from ....pipeline.core.system import terminate_self

IDLE_S = 60.0  # without an order, after which it exits

_TO_TIDY_UP_S = 5.0
_ASKED_TO_LEAVE = 128 + signal.SIGTERM  # the exit code of `main` then


def serve() -> None:
    """Do what each line of stdin orders, {"words": of the command line, "log": a file for all that is said}, and answer
    with its exit code, and behind a space the code of its refusal if there is one, on what is stdout now."""
    answers = os.fdopen(os.dup(1), "w", encoding="ascii")
    orders: SimpleQueue[dict[str, Any]] = SimpleQueue()
    threading.Thread(target=_listen, args=(orders,), daemon=True).start()
    while True:
        try:
            order = orders.get(timeout=IDLE_S)
        except Empty:
            return
        exit_code, code = _ended(order["words"], order["log"])
        if exit_code == _ASKED_TO_LEAVE:
            sys.exit(exit_code)
        print(exit_code, code, file=answers, flush=True)


def _listen(orders: SimpleQueue[dict[str, Any]]) -> None:
    """Pass orders on until stdin ends, then leave as on SIGTERM, or at once if that does not help."""
    for line in FileIO(0, closefd=False):
        orders.put(json.loads(line))
    terminate_self()
    time.sleep(_TO_TIDY_UP_S)
    os._exit(_ASKED_TO_LEAVE)


def _ended(words: list[str], log: str) -> tuple[int, str]:
    """Exit code of the command line, which says to `log` whatever it has to say, and the code of its refusal."""
    _say_to(log)
    sys.argv = ["pcnet3d", *words]
    try:
        main()
        return 0, ""
    except SystemExit as end:
        refusal = end.__context__  # for which `main` ended
        code = refusal.code if isinstance(refusal, InputError) else ""
        return end.code if isinstance(end.code, int) else int(end.code is not None), code
    finally:
        _say_to(os.devnull)  # the log is its owner's again


def _say_to(path: str) -> None:
    """Stdout and stderr, also those of libraries, go to the end of this file."""
    sys.stdout.flush()
    sys.stderr.flush()
    with open(path, "ab") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)


if __name__ == "__main__":
    serve()
