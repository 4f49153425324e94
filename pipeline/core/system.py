"""What differs between operating systems: processes, memory, cores and threads, names of files, words on a command
line. Nothing else asks which system this is."""

from __future__ import annotations

import _thread
import ctypes
import multiprocessing
import os
import re
import shlex
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.process import BaseProcess
from typing import Any

# Windows gives these to devices, with any suffix and in any case.
_DEVICES = re.compile(r"(con|prn|aux|nul|conin\$|conout\$|com[0-9¹²³]|lpt[0-9¹²³])\s*(\.|$)", re.IGNORECASE)
_NO_NAME = re.compile(r'[\x00-\x1f\x7f/\\:*?"<>|]|^[.\s]|[.\s]$|^$')


def is_file_name(name: str) -> bool:
    """Whether every system takes it as the name of a file or folder, one that is not hidden."""
    return not _NO_NAME.search(name) and not _DEVICES.match(name)


def quoted(word: object) -> str:
    """A word as it is typed in this system's shell."""
    return subprocess.list2cmdline([str(word)]) if sys.platform == "win32" else shlex.quote(str(word))


def cores_given() -> int:
    """The cores that this process may use, which in a container may be fewer than the machine's."""
    if sys.platform == "linux":
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def cores() -> int:
    """The cores that were given to this process; no more than OMP_NUM_THREADS says, where it is set: a batch runs one
    process for each core, with one thread. onnxruntime, FFmpeg and pools of threads are given this number by who opens
    them; BLAS and Arrow read the same variable themselves."""
    most = os.environ.get("OMP_NUM_THREADS", "")
    return min(cores_given(), max(int(most), 1)) if most.isdecimal() else cores_given()


def limit_opencv() -> None:
    """OpenCV, which reads a variable of its own when it is imported, computes with as many threads as everything else.
    Of a whole program: a caller of single functions decides by `cv2.setNumThreads`."""
    os.environ.setdefault("OPENCV_FOR_THREADS_NUM", str(cores()))


def give_memory_back() -> None:
    """Give what was freed back to the system, where its allocator keeps it for itself (glibc; some milliseconds)."""
    if sys.platform == "linux":
        with suppress(AttributeError):
            ctypes.CDLL(None).malloc_trim(0)


def pipe_path(descriptor: int) -> str | None:
    """A path at which the open end of a pipe is opened once more; None where the system has none, as Windows."""
    return None if sys.platform == "win32" else f"/dev/fd/{descriptor}"


def is_running(process: int) -> bool:
    """Whether there is a process of that number, anybody's."""
    if sys.platform == "win32":  # where os.kill would end it
        import psutil

        return psutil.pid_exists(process)
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # somebody else's
        return True
    return True


def process_context(preload: Sequence[str]) -> Any:
    """Of multiprocessing: how processes of Python are started. preload: modules that each needs and that begin no
    threads; on Linux they are imported once for all."""
    if sys.platform != "linux":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(list(preload))
    return context


def leave_terminal() -> None:
    """From now on Ctrl-C on the terminal leaves this process alone."""
    if sys.platform == "win32":
        ctypes.windll.kernel32.SetConsoleCtrlHandler(None, True)
    else:
        os.setsid()


def kill(process: BaseProcess) -> None:
    """End at once a process that did `leave_terminal`, and what it has started."""
    if sys.platform == "win32":
        import psutil

        with suppress(psutil.NoSuchProcess):
            for each in psutil.Process(process.pid).children(recursive=True):
                with suppress(psutil.NoSuchProcess):
                    each.kill()
    else:
        with suppress(ProcessLookupError):
            os.killpg(process.pid or 0, signal.SIGKILL)
    process.kill()
    process.join()


def terminate_self() -> None:
    """This process gets SIGTERM, from any of its threads."""
    if sys.platform == "win32":  # where os.kill would not run the handler
        _thread.interrupt_main(signal.SIGTERM)
    else:
        os.kill(os.getpid(), signal.SIGTERM)
