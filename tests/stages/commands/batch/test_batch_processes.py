"""How the process of a take is started and asked to leave."""

import io
import subprocess
import sys

import pytest

from pcnet3d.stages.commands.batch import take
from pcnet3d.stages.commands.batch.manifest import Entry
from pcnet3d.stages.commands.batch.take import Job


@pytest.fixture
def job(tmp_path) -> Job:
    (tmp_path / "logs").mkdir()
    return Job(Entry("a", {}, (), {}), tmp_path)


@pytest.mark.parametrize("told", ["1", "8"])
def test_a_take_computes_in_one_thread_and_writes_utf_8(job, monkeypatch, told):
    started = {}

    class Child:
        stdin = io.BytesIO()

        def wait(self, timeout=None):
            return 0

    monkeypatch.setattr(take.subprocess, "Popen", lambda command, **how: started.update(how) or Child())
    for name in ("OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
        monkeypatch.setenv(name, told)
    monkeypatch.setenv("PYTHONIOENCODING", "cp1252")
    assert take._run(job, False) == (0, "")
    environment = started["env"]
    assert {environment[name] for name in environment if name.endswith(("NUM_THREADS", "THREADS_NUM"))} == {
        "1"
    }
    assert environment["PYTHONIOENCODING"] == "utf-8"
    assert Child.stdin.closed


def test_a_take_that_is_asked_leaves_by_itself_and_tidies_up():
    code = (
        "import sys, threading, time\n"
        "from pcnet3d.stages.commands.batch.child import _end_with_parent\n"
        "import signal; signal.signal(signal.SIGTERM, lambda *_: sys.exit(9))\n"
        "threading.Thread(target=_end_with_parent, daemon=True).start()\n"
        "try:\n"
        "    print('begun', flush=True)\n"
        "    while True: time.sleep(0.01)\n"
        "finally: print('tidied up', flush=True)"
    )
    child = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    assert child.stdout.readline().strip() == b"begun"
    take._ask_to_leave(child)
    take._ask_to_leave(child)  # it was told
    assert child.wait(60) == 9
    assert child.stdout.read().strip() == b"tidied up"
