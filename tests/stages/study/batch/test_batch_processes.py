"""A take's own process: its log and exit code, one that dies or takes too long, and one whose parent is gone."""

import os
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from pcnet3d.pipeline import InputError
from pcnet3d.stages.study.batch import take
from pcnet3d.stages.study.batch.take import PRELOADED, run_apart


def refuse() -> None:
    print("looking", flush=True)
    raise InputError("cannot-open", "Expected a file.")


def break_down() -> None:
    raise ValueError("a fault")


def test_each_take_has_a_log_and_an_exit_code_of_its_own(tmp_path):
    good, bad, faulty = (tmp_path / f"{name}.txt" for name in ("good", "bad", "faulty"))
    bad.write_text("of an earlier run")
    assert run_apart(partial(print, "words"), good, None) == (0, "", "")
    assert run_apart(refuse, bad, None) == (2, "Expected a file.", "cannot-open")
    ended = run_apart(break_down, faulty, None)
    assert (ended.exit_code, ended.code) == (1, "")
    assert "ValueError: a fault" in ended.reason
    assert good.read_text() == "words\n"
    assert "looking" in bad.read_text()
    assert "of an earlier run" not in bad.read_text()
    assert "words" not in bad.read_text()
    assert "Traceback" in faulty.read_text()


@pytest.mark.parametrize("told", ["1", "8"])
def test_a_take_computes_in_one_thread_and_writes_utf_8(tmp_path, monkeypatch, told):
    started = {}

    class Context:
        Pipe = staticmethod(take.process_context(()).Pipe)

        def Process(self, **how):
            started.update(os.environ)
            raise OSError(12, "no memory")

    monkeypatch.setattr(take, "process_context", lambda preload: Context())
    for name in ("OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
        monkeypatch.setenv(name, told)
    for name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(name, "")
    monkeypatch.setenv("PYTHONIOENCODING", "cp1252")
    with pytest.raises(OSError, match="no memory"):
        run_apart(print, tmp_path / "log.txt", None)
    threads = {started[name] for name in started if name.endswith(("NUM_THREADS", "THREADS_NUM"))}
    assert threads == {"1"}
    assert started["PYTHONIOENCODING"] == "utf-8"


@pytest.mark.skipif(
    not Path("/proc/self/status").exists(), reason="only Linux tells how many threads there are"
)
def test_what_is_imported_before_a_fork_begins_no_thread():
    code = f"import importlib\nfor name in {PRELOADED}: importlib.import_module(name)\n"
    code += "print(open('/proc/self/status').read().split('Threads:')[1].split()[0])"
    environment = {**os.environ, **take._ENVIRONMENT}
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
    assert told.stdout.strip() == "1", told.stderr
