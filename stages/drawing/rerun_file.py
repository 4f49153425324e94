"""A recording in a file, written so that a full disk ends it and any number of threads may ask for one."""

from __future__ import annotations

import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from ...pipeline.core.errors import InputError
from ...pipeline.core.system import pipe_path

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb

_CHUNK = 1 << 20  # bytes that are copied at a time
_END = b"RRF2FOOT"  # of the .rrd format, and 4 bytes after it
# Several recordings at once in one process were seen to wait for each other for ever; the cause is not known.
_TURN = threading.RLock()
# Or the SDK's allocator keeps what it has freed, in a long take 100 MB; read when the SDK is imported.
os.environ.setdefault("MIMALLOC_PURGE_DELAY", "0")


class RecordingFile:
    """stream: what is logged into. What the SDK writes goes through a pipe, and a thread copies it into the file:
    where the SDK itself finds the disk full, it tries again for ever."""

    def __init__(self, path: Path, name: Path, views: rrb.Container) -> None:
        import rerun as rr
        import rerun.blueprint as rrb
        from rerun_bindings import flush_and_cleanup_orphaned_recordings

        # As rr.init does: else the SDK keeps threads and memory of every earlier take's recording.
        flush_and_cleanup_orphaned_recordings()
        self._path, self._name = path, name
        self._failure: OSError | None = None
        self._copying: threading.Thread | None = None
        self.stream: rr.RecordingStream = rr.RecordingStream("pcnet3d")
        time = rrb.TimePanel(state="collapsed", timeline="video_time")
        blueprint = rrb.Blueprint(views, time, collapse_panels=True)
        path.touch()
        source, sink = os.pipe()
        try:
            through = pipe_path(sink)
            if through is not None:
                self._copying = threading.Thread(target=self._copy, args=(source,), daemon=True)
                self._copying.start()
            self.stream.save(through or path, default_blueprint=blueprint)
        finally:
            os.close(sink)  # the SDK has its own
            if self._copying is None:
                os.close(source)

    def check(self) -> None:
        """InputError where the file could not be written so far."""
        if self._failure is not None:
            reason = self._failure.strerror or self._failure
            raise InputError(
                "cannot-write",
                f"The recording {self._name} could not be written: {reason}; make room there or choose another folder.",
            )

    def close(self) -> None:
        """The last of it into the file."""
        self.stream.disconnect()
        if self._copying is not None:
            self._copying.join()

    def check_end(self) -> None:
        """InputError where the file is not whole."""
        self.check()
        with open(self._path, "rb") as file:
            file.seek(max(self._path.stat().st_size - len(_END) - 4, 0))
            if not file.read().startswith(_END):
                raise InputError(
                    "cannot-write",
                    f"The recording {self._name} could not be written to its end; is the disk full?",
                )

    def _copy(self, source: int) -> None:
        """What comes through the pipe into the file; after a failure it is still taken, so that the SDK ends."""
        with open(source, "rb", buffering=0) as pipe, open(self._path, "wb", buffering=0) as file:
            while part := pipe.read(_CHUNK):
                left = memoryview(part)
                while left and self._failure is None:
                    try:
                        left = left[file.write(left) :]
                    except OSError as error:
                        self._failure = error


@contextmanager
def recording_file(path: Path, views: rrb.Container, name: Path) -> Iterator[RecordingFile]:
    """A new recording into the file `path`, complete when the block ends. views: what it opens with, at the video's
    time. name: how a refusal calls the file, for `path` is temporary.

    Threads of one process take turns: who asks while another thread records waits until that recording has ended.
    InputError where the file cannot be written.
    """
    from rerun.error_utils import catch_and_log_exceptions

    with _TURN, catch_and_log_exceptions(strict=True):
        try:
            file = RecordingFile(path, name, views)
            try:
                yield file
                file.stream.flush()
            finally:
                file.close()
        except RuntimeError as error:
            raise InputError("cannot-write", f"The recording {name} could not be written: {error}.") from None
        file.check_end()
