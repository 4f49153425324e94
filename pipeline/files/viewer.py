"""Opening a recording in the rerun viewer, on this machine only and without a word to any other."""

from __future__ import annotations

import http.client
import io
import os
import shutil
import socket
import subprocess
import threading
import time
import webbrowser
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import BinaryIO

from ..core.errors import InputError
from ..core.system import apart
from .atomic import REPORT
from .names import PAGES, RECORDING, find_page

_HERE = "127.0.0.1"
_PORT = 9090
_PAGE = ("/", "/re_viewer.js", "/re_viewer_bg.wasm", "/favicon.ico")
_START_S = 20.0
_LOOK_S = 0.1  # between looks at a recording that grows
# The viewer sends usage data unless it believes to be in continuous integration, and asks GitHub for its newest
# version: the first is switched off so (re_analytics/src/native/pipeline.rs), the second meets a closed door.
QUIET = {"CI": "1", "HTTPS_PROXY": f"http://{_HERE}:9", "RUST_LOG": "error"}
# In a browser there is no such switch: this keeps the page from loading from or sending to any other place.
_ONLY_HERE = "default-src 'self' 'unsafe-inline' 'wasm-unsafe-eval' data: blob:"


def view(folder: Path, web: bool = False) -> None:
    """Open a run's folder, or a recording itself, and return when the viewer is closed.

    web: serve it to a browser on this machine instead, until interrupted. Raises InputError when there is no
    recording, or when no viewer opens.
    """
    recording = find_recording(folder)
    if web:
        server = _server(recording, _viewer_files())
        print(f"{_page(server)}\nOpen it in a browser on this machine; Ctrl-C ends.", flush=True)
        webbrowser.open(_page(server))
        with server, suppress(KeyboardInterrupt):
            server.serve_forever()
        return
    # Without an address the viewer would listen to the whole network.
    ended = subprocess.run(_viewer(str(recording)), env=os.environ | QUIET)
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


def view_page(folder: Path) -> None:
    """Open the folder's page in the browser, or say where it is on a machine without one. InputError when there is no
    page."""
    page = find_page(folder)
    if page is None:
        inside = sorted(run.parent.name for run in folder.glob(f"*/{REPORT}"))
        hint = f"; it holds runs, such as {folder / inside[0]}" if inside else ""
        raise InputError(
            "format-unknown", f"Expected a folder with one of {', '.join(PAGES)}, got {folder}{hint}."
        )
    if not webbrowser.open(page.resolve().as_uri()):
        print(f"There is no browser here; open {page}")


def viewer_executable() -> str:
    """The rerun viewer that the package rerun-sdk brought; InputError when it did not."""
    import rerun_cli

    folder = Path(rerun_cli.__file__).parent
    for name in ("Rerun.app/Contents/MacOS/Rerun", "rerun.exe", "rerun"):
        if (folder / name).is_file():
            return str(folder / name)
    raise InputError("needs-package", "The rerun viewer is not installed; reinstall the package rerun-sdk.")


def _viewer(recording: str) -> list[str]:
    """The words that open a file or an address in it; on a port of its own, for whoever holds its usual one would be
    handed the recording."""
    return [viewer_executable(), "--bind", _HERE, "--port", "auto", recording]


@contextmanager
def following(recording: Path, web: bool = False) -> Iterator[None]:
    """Show a recording while the block writes it, in the viewer or, with `web`, in a browser on this machine. What is
    shown stays when the block ends. InputError when no viewer opens."""
    ended = threading.Event()
    server = _server(recording, _viewer_files() if web else {}, ended)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        if web:
            print(f"{_page(server)}\nOpen it in a browser on this machine.", flush=True)
            webbrowser.open(_page(server))
        else:
            command, silent = _viewer(f"{_origin(server)}/{RECORDING}"), subprocess.DEVNULL
            subprocess.Popen(command, env=os.environ | QUIET, stdout=silent, stderr=silent, **apart())
        yield
    finally:
        ended.set()


def _server(
    recording: Path, files: dict[str, tuple[str, bytes]], ended: threading.Event | None = None
) -> ThreadingHTTPServer:
    handler = _handler(recording, files, ended)
    try:
        return ThreadingHTTPServer((_HERE, _PORT), handler)
    except OSError:  # somebody has that port
        return ThreadingHTTPServer((_HERE, 0), handler)


def _origin(server: ThreadingHTTPServer) -> str:
    return f"http://{_HERE}:{server.server_port}"


def _page(server: ThreadingHTTPServer) -> str:
    return f"{_origin(server)}/?url={_origin(server)}/{RECORDING}"


def _viewer_files() -> dict[str, tuple[str, bytes]]:
    """Media type and content of the files that make the viewer's page, as rerun serves them."""
    with socket.socket() as free:
        free.bind((_HERE, 0))
        port = free.getsockname()[1]
    # Named an address that a browser can load, rerun serves its page alone; the address is not visited.
    address = f"http://{_HERE}/{RECORDING}"
    command = [viewer_executable(), "--serve-web", "--bind", _HERE, "--web-viewer-port", str(port), address]
    silent = subprocess.DEVNULL
    with subprocess.Popen(command, env=os.environ | QUIET, stdout=silent, stderr=silent) as process:
        try:
            return {path: _fetched(port, path) for path in _PAGE}
        finally:
            process.terminate()


def _fetched(port: int, path: str) -> tuple[str, bytes]:
    until = time.monotonic() + _START_S
    while True:
        connection = http.client.HTTPConnection(_HERE, port)
        try:
            connection.request("GET", path)
            answer = connection.getresponse()
            return answer.getheader("Content-Type", ""), answer.read()
        except ConnectionRefusedError:
            if time.monotonic() > until:
                raise InputError("no-device", "The web viewer did not start; try without --web.") from None
            time.sleep(0.1)
        finally:
            connection.close()


def _handler(
    recording: Path, files: dict[str, tuple[str, bytes]], ended: threading.Event | None = None
) -> type[BaseHTTPRequestHandler]:
    """ended: of a recording that is still being written, set when it no longer is."""

    class Handler(BaseHTTPRequestHandler):
        """The viewer's files and the recording, nothing else."""

        def do_GET(self) -> None:
            path = self.path.partition("?")[0]
            # A page elsewhere could point its own name at this machine to read the recording.
            if self.headers.get("Host", "").partition(":")[0] not in (_HERE, "localhost"):
                self.send_error(403)
            elif path == f"/{RECORDING}":
                with recording.open("rb") as file:
                    length = recording.stat().st_size if ended is None else None
                    self._send("application/octet-stream", length, file)
            elif path in files:
                media_type, content = files[path]
                self._send(media_type, len(content), io.BytesIO(content))
            else:
                self.send_error(404)

        def _send(self, media_type: str, length: int | None, content: BinaryIO) -> None:
            """length: None for a file that grows until `ended`; the answer then ends with the connection."""
            self.send_response(200)
            self.send_header("Content-Type", media_type)
            if length is not None:
                self.send_header("Content-Length", str(length))
            self.send_header("Content-Security-Policy", _ONLY_HERE)
            self.end_headers()
            with suppress(ConnectionError):  # the browser went away
                over = length is not None
                while not over:
                    over = ended is None or ended.wait(_LOOK_S)
                    shutil.copyfileobj(content, self.wfile)
                shutil.copyfileobj(content, self.wfile)

        def log_message(self, format: str, *args: object) -> None:
            """No line for a request."""

    return Handler
