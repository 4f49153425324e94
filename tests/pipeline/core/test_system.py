"""Windows and macOS as far as Linux can play them: what each system is asked, names of files, files that are open."""

import ast
import os
import shutil
import subprocess
import sys
import time
import types
from contextlib import suppress
from pathlib import Path

import psutil
import pytest

import commands
import pcnet3d
from pcnet3d.examples.walker.camera import side_camera
from pcnet3d.examples.walker.files import write_files
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.core import system
from pcnet3d.pipeline.files.atomic import whole_file, whole_folder
from pcnet3d.pipeline.plugins.registry import registered
from pcnet3d.pipeline.reading.settings import RunOptions
from pcnet3d.pipeline.running.recipe import Recipe, StageEntry, planned
from pcnet3d.pipeline.running.run import run_files

ROOT = Path(pcnet3d.__file__).parent
SOURCES = [
    path
    for part in ("pipeline", "adapters", "models", "stages", "examples")
    for path in sorted((ROOT / part).rglob("*.py"))
]
ONLY_SOMEWHERE = {
    "os": {
        "chown", "chroot", "fork", "forkpty", "getegid", "geteuid", "getgid", "getloadavg", "getpgid", "getpgrp",
        "getsid", "getuid", "kill", "killpg", "link", "mkfifo", "mknod", "name", "nice", "openpty", "posix_spawn",
        "rename", "renames", "sched_getaffinity", "sched_setaffinity", "setpgid", "setsid", "setuid", "startfile",
        "statvfs", "symlink", "sysconf", "ttyname", "uname", "wait",
    },
    "signal": {
        "SIGALRM", "SIGBREAK", "SIGCHLD", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGQUIT", "SIGUSR1", "SIGUSR2", "alarm",
        "pause", "pthread_kill", "setitimer", "sigwait",
    },
    "sys": {"getwindowsversion", "platform"},
    "time": {"clock_gettime", "tzset"},
}  # fmt: skip
MODULES = {
    "curses", "fcntl", "grp", "msvcrt", "nt", "platform", "posix", "psutil", "pty", "pwd", "readline", "resource",
    "shlex", "termios", "tty", "winreg",
}  # fmt: skip
KEYWORDS = {"creationflags", "preexec_fn", "start_new_session", "startupinfo"}
METHODS = {"hardlink_to", "symlink_to"}
PLACES = ("/dev/", "/etc/", "/proc/", "/sys/", "/tmp", "/usr/", "/var/", "C:\\")


def system_names(source: str) -> set[str]:
    """What in a module's source there is on some systems only, means something else on another, or forks."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Attribute):
            owner = node.value.id if isinstance(node.value, ast.Name) else ""
            found |= {f"{owner}.{node.attr}"} if node.attr in ONLY_SOMEWHERE.get(owner, ()) else set()
            found |= {node.attr} & METHODS
        if isinstance(node, ast.Import):
            found |= {each.name for each in node.names if each.name.partition(".")[0] in MODULES}
        if isinstance(node, ast.ImportFrom) and not node.level:
            found |= {node.module} & MODULES
            hidden = ONLY_SOMEWHERE.get(node.module, set()) | (
                {"Process", "Pool"} if "multi" in node.module else set()
            )
            found |= {f"{node.module}.{each.name}" for each in node.names if each.name in hidden}
        if isinstance(node, ast.Call):
            given = {each.arg for each in node.keywords}
            found |= given & KEYWORDS
            if (
                isinstance(node.func, ast.Name)
                and node.func.id == "ProcessPoolExecutor"
                and "mp_context" not in given
            ):
                found.add("ProcessPoolExecutor without mp_context")
            if isinstance(node.func, ast.Name) and node.func.id == "get_context":
                found |= {each.value for each in node.args if isinstance(each, ast.Constant)} - {"spawn"}
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.startswith(PLACES):
            found.add(node.value)
    return found


def test_one_module_asks_which_system_it_is():
    found = {
        path.relative_to(ROOT).as_posix(): names
        for path in SOURCES
        if (names := system_names(path.read_text(encoding="utf-8")))
    }
    assert found.keys() == {"pipeline/core/system.py"}, found
    assert len(SOURCES) > 200


@pytest.fixture
def on(monkeypatch):
    """on("win32"): from now on `system` believes so."""

    def believe(name: str) -> None:
        fake = types.SimpleNamespace(**{**vars(sys), "platform": name})
        monkeypatch.setattr(system, "sys", fake)
        monkeypatch.setattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0x200, raising=False)

    return believe


SYSTEMS = pytest.mark.parametrize("name", ["linux", "darwin", "win32"])


@SYSTEMS
def test_processes_that_run_and_that_are_gone(on, name):
    on(name)
    gone = subprocess.Popen([sys.executable, "-c", ""])
    gone.wait()
    assert system.is_running(os.getpid())
    assert not system.is_running(gone.pid)


def test_windows_never_sends_signal_0_which_would_end_the_process(on, monkeypatch):
    on("win32")
    monkeypatch.setattr(os, "kill", lambda *_: pytest.fail("a process was ended"))
    monkeypatch.setattr(psutil, "pid_exists", lambda process: process == 5)
    assert system.is_running(5)
    assert not system.is_running(6)


@SYSTEMS
def test_a_process_is_ended_with_what_it_started(on, name, tmp_path):
    code = (
        "import pathlib, subprocess, sys\n"
        "from pcnet3d.pipeline.core.system import leave_terminal\n"
        "leave_terminal()\n"
        "p = subprocess.Popen([sys.executable, '-c', 'input()'], stdin=-1)\n"
        f"pathlib.Path({str(tmp_path / 'told')!r}).write_text(str(p.pid)); p.wait()"
    )
    process = system.process_context(()).Process(target=exec, args=(code,))
    process.start()
    while not ((told := tmp_path / "told").exists() and told.read_text()):
        time.sleep(0.01)
    started = psutil.Process(int(told.read_text()))
    on(name)
    system.kill(process)
    system.kill(process)  # it is gone, and that is no fault
    assert process.exitcode
    with suppress(psutil.NoSuchProcess):
        while started.status() != psutil.STATUS_ZOMBIE:  # nobody may have asked how it ended
            time.sleep(0.01)


@SYSTEMS
def test_a_thread_ends_its_process_through_the_handler(name):
    code = (
        "import signal, subprocess, sys, threading, time, types\n"
        "from pcnet3d.pipeline.core import system\n"
        "signal.signal(signal.SIGTERM, lambda *_: sys.exit(7))\n"
        f"system.sys = types.SimpleNamespace(platform={name!r})\n"
        "threading.Timer(0.2, system.terminate_self).start()\n"
        "while True: time.sleep(0.01)"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 7


def test_words_are_quoted_for_the_shell(on):
    assert system.quoted(Path("a b/c")) == "'a b/c'"
    on("win32")
    assert system.quoted(r"C:\a b\c") == r'"C:\a b\c"'
    assert system.quoted("plain") == "plain"


def test_names_that_some_system_refuses_and_that_every_system_takes():
    for name in [
        "", "a:b", "a/b", "a\\b", "a*", 'a"', "a?", "a|b", "a.", "a ", ".a", " a", "a\n", "con", "CON",
        "Con.txt", "nul", "COM1", "lpt9.csv", "com¹", "aux .txt", "CONIN$",
    ]:  # fmt: skip
        assert not system.is_file_name(name), name
    for name in ["walk", "P01 visit 2", "ä-1", "console", "com10", "a.b", "nullity", "con1", "com"]:
        assert system.is_file_name(name), name


def held(path: str | os.PathLike[str]) -> list[str]:
    """The files at or below a path that this process has open or mapped."""
    inside = os.path.realpath(path)
    found = []
    for handle in os.listdir("/proc/self/fd"):
        try:
            found.append(os.readlink(f"/proc/self/fd/{handle}"))
        except OSError:
            continue
    maps = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    found += [line.split(None, 5)[5].strip() for line in maps if "/" in line]
    return [each for each in found if each == inside or each.startswith(inside + os.sep)]


@pytest.fixture
def windows_files(monkeypatch):
    """Renaming and deleting as Windows does: never what is open or mapped, nor onto a folder."""
    if sys.platform != "linux":
        pytest.skip("needs /proc to play another system")
    replace, unlink = os.replace, os.unlink

    def strict_replace(old, new) -> None:
        if os.path.isdir(new):
            raise PermissionError(13, "Windows replaces no folder", str(new))
        if open_ones := [*held(old), *held(new)]:
            raise PermissionError(13, "Windows renames nothing that is open", open_ones[0])
        replace(old, new)

    def strict_unlink(path, *, dir_fd=None) -> None:
        full = Path(os.readlink(f"/proc/self/fd/{dir_fd}"), path) if dir_fd is not None else path
        if held(full):
            raise PermissionError(13, "Windows deletes nothing that is open", str(full))
        unlink(path, dir_fd=dir_fd)

    monkeypatch.setattr(os, "replace", strict_replace)
    monkeypatch.setattr(os, "unlink", strict_unlink)
    monkeypatch.setattr(os, "remove", strict_unlink)


def test_a_folder_is_replaced(windows_files, tmp_path):
    for content in ("one", "two"):
        with whole_folder(tmp_path / "out", force=True) as folder:
            (folder / "file").write_text(content, encoding="utf-8")
        assert (tmp_path / "out" / "file").read_text(encoding="utf-8") == content
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_file_that_a_viewer_has_open_stays_as_it_was(windows_files, tmp_path):
    path = tmp_path / "out" / "file"
    with whole_folder(tmp_path / "out") as folder:
        (folder / "file").write_text("one", encoding="utf-8")
    with open(path, encoding="utf-8"):
        with pytest.raises(PermissionError), whole_folder(tmp_path / "out", force=True) as folder:
            (folder / "file").write_text("two", encoding="utf-8")
        with pytest.raises(PermissionError), whole_file(path) as partial:
            partial.write_text("three", encoding="utf-8")
    assert path.read_text(encoding="utf-8") == "one"
    assert [each.name for each in tmp_path.iterdir()] == ["out"]
    assert sorted(each.name for each in path.parent.iterdir()) == ["file", "summary.json"]


def test_a_run_with_every_writer_leaves_no_file_open(windows_files, tmp_path):
    walk = walker(seconds=1)
    (tmp_path / "in").mkdir()
    files = write_files(tmp_path / "in", walk, side_camera(walk))
    options = RunOptions(
        poses=files.poses,
        video=files.video,
        keypoints=files.keypoints,
        stature=1.75,
        also=tuple(registered("writers")),
    )
    run_files(options, tmp_path / "out", planned(options))
    quick = Recipe(stages=(StageEntry(use="rectify"),))  # takes the place of the first one
    run_files(RunOptions(poses=files.poses, fps=30), tmp_path / "out", quick)
    assert not held(tmp_path)
    shutil.rmtree(tmp_path / "in")


def test_a_console_of_windows_can_print_every_word():
    names = [[], *([name] for name in registered("commands")), *(["lab", name] for name in registered("lab"))]
    said = ""
    for words in (*([*name, "--help"] for name in names), ["list", "devices"]):
        said += commands.succeeded(commands.pcnet3d(*words, encoding="cp1252", COLUMNS="120")).stdout
    assert len(said) > 10_000
    assert "\\u" not in said  # what could not be printed
    assert "\\x" not in said
