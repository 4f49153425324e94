"""`pcnet3d view` finds the recording, and serves it to this machine alone."""

import http.client
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import ThreadingHTTPServer

import pytest

from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.viewer import _handler, _viewer_files, find_recording, view, viewer_executable


@pytest.fixture
def run_folder(tmp_path):
    (tmp_path / "take.rrd").write_bytes(b"RRF2 some bytes")
    return tmp_path


def test_folder_or_file(run_folder):
    recording = run_folder / "take.rrd"
    assert find_recording(run_folder) == find_recording(recording) == recording


@pytest.mark.parametrize("name", ["nothing", "", "video.mp4"])
def test_no_recording(tmp_path, name):
    (tmp_path / "video.mp4").write_bytes(b"")
    with pytest.raises(InputError, match=r"take\.rrd"):
        view(tmp_path / name)


def test_viewer_is_started_for_this_machine_only_and_silent(run_folder, monkeypatch):
    started = {}

    def run(command, env):
        started.update(command=command, env=env)
        return type("Ended", (), {"returncode": 0})

    monkeypatch.setattr("subprocess.run", run)
    view(run_folder)
    command = started["command"]
    assert command[0] == viewer_executable()
    assert command[command.index("--bind") + 1] == "127.0.0.1"
    assert command[-1] == str(run_folder / "take.rrd")
    assert started["env"]["CI"] == "1"


def test_viewer_that_does_not_open(run_folder, monkeypatch):
    monkeypatch.setattr("subprocess.run", lambda *_, **__: type("Ended", (), {"returncode": 1}))
    with pytest.raises(InputError, match="--web"):
        view(run_folder)


@contextmanager
def serving(handler) -> Iterator[int]:
    """The port of a server with that handler."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
    yield server.server_port
    server.shutdown()
    server.server_close()


def begun(port: int, path: str, host: str = "127.0.0.1") -> http.client.HTTPResponse:
    """The answer of that server, not read yet."""
    connection = http.client.HTTPConnection("127.0.0.1", port)
    connection.request("GET", path, headers={"Host": f"{host}:{port}"})
    return connection.getresponse()


@pytest.fixture
def get(run_folder):
    """get(path, host): the answer of the web viewer's server, with stand-ins for the viewer's own files."""
    files = {"/": ("text/html", b"<html>"), "/re_viewer_bg.wasm": ("application/wasm", b"\0asm")}

    def ask(path: str, host: str = "127.0.0.1") -> tuple[http.client.HTTPResponse, bytes]:
        answer = begun(port, path, host)
        return answer, answer.read()

    with serving(_handler(run_folder / "take.rrd", files)) as port:
        yield ask


def test_page_and_recording_are_served_and_fenced_in(get):
    for path, content in (
        ("/take.rrd", b"RRF2 some bytes"),
        ("/?url=http://x", b"<html>"),
        ("/re_viewer_bg.wasm", b"\0asm"),
    ):
        answer, body = get(path)
        assert (answer.status, body) == (200, content)
        policy = answer.getheader("Content-Security-Policy")
        assert policy.startswith("default-src 'self'")
        assert "http" not in policy


@pytest.mark.parametrize("path", ["/../secret", "/etc/passwd", "/other.rrd"])
def test_nothing_else_is_served(get, path):
    assert get(path)[0].status == 404


def test_other_host_names_are_refused(get):
    """A web page whose name was pointed at this machine must not read the recording."""
    assert get("/take.rrd", host="example.com")[0].status == 403


def test_the_installed_viewer_has_the_files_of_its_page():
    files = _viewer_files()
    assert files["/"][0] == "text/html"
    assert b"re_viewer.js" in files["/"][1]
    assert files["/re_viewer_bg.wasm"][0] == "application/wasm"
    assert files["/re_viewer_bg.wasm"][1].startswith(b"\0asm")


def test_a_recording_that_grows_is_sent_until_it_ends(tmp_path):
    path, ended = tmp_path / "live.rrd", threading.Event()
    path.write_bytes(b"first ")
    with serving(_handler(path, {}, ended)) as port:
        answer = begun(port, "/take.rrd")
        assert answer.getheader("Content-Length") is None
        assert answer.read(6) == b"first "
        with path.open("ab") as file:
            file.write(b"second ")
        assert answer.read(7) == b"second "
        with path.open("ab") as file:
            file.write(b"last")
        ended.set()
        assert answer.read() == b"last"
