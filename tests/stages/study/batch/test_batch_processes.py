"""How the process of takes is started and asked to leave."""

import io
import subprocess
import sys

import pytest

from pcnet3d.stages.study.batch import workers


@pytest.mark.parametrize("told", ["1", "8"])
def test_a_take_computes_in_one_thread_and_writes_utf_8(tmp_path, monkeypatch, told):
    started = {}

    class Child:
        stdin, stdout = io.BytesIO(), io.BytesIO(b"3\n")

    monkeypatch.setattr(workers.subprocess, "Popen", lambda command, **how: started.update(how) or Child())
    for name in ("OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
        monkeypatch.setenv(name, told)
    monkeypatch.setenv("PYTHONIOENCODING", "cp1252")
    assert workers.Worker(tmp_path / "log.txt").run(["run"], tmp_path / "log.txt", None) == (3, "")
    environment = started["env"]
    assert {environment[name] for name in environment if name.endswith(("NUM_THREADS", "THREADS_NUM"))} == {
        "1"
    }
    assert environment["PYTHONIOENCODING"] == "utf-8"


def test_a_take_that_is_asked_leaves_by_itself_and_tidies_up(tmp_path, monkeypatch):
    code = (
        "import queue, sys, threading, time\n"
        "from pcnet3d.stages.study.batch.child import _listen\n"
        "import signal; signal.signal(signal.SIGTERM, lambda *_: sys.exit(9))\n"
        "threading.Thread(target=_listen, args=(queue.SimpleQueue(),), daemon=True).start()\n"
        "try:\n"
        "    print('begun', flush=True)\n"
        "    while True: time.sleep(0.01)\n"
        "finally: print('tidied up', flush=True)"
    )
    start = subprocess.Popen
    monkeypatch.setattr(
        workers.subprocess, "Popen", lambda command, **how: start([sys.executable, "-c", code], **how)
    )
    worker = workers.Worker(tmp_path / "log.txt")
    assert worker.process.stdout.readline().strip() == b"begun"
    worker.ask_to_leave()
    worker.ask_to_leave()  # it was told
    assert worker.process.wait(60) == 9
    assert worker.process.stdout.read().strip() == b"tidied up"
    with pytest.raises(ValueError, match="closed"):
        worker.process.stdin.write(b"more")
    assert worker.run(["run"], tmp_path / "log.txt", None) == (9, "")
