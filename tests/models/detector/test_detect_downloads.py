"""Networks of detectors: downloaded once with their licence, put in place by hand, or asked for in words."""

import hashlib
import http.server
import socket
import threading
import zipfile
from functools import partial
from pathlib import Path

import pytest

import commands
from pcnet3d.models.common import download as networks
from pcnet3d.models.common.download import MOVENET, Network
from refusals import refused


@pytest.fixture
def served(tmp_path, toy, monkeypatch):
    """An address that serves the toy as toy.onnx and in toy.zip, and the cache that downloads go to."""
    folder = tmp_path / "served"
    folder.mkdir()
    (folder / "toy.onnx").write_bytes(toy.read_bytes())
    with zipfile.ZipFile(folder / "toy.zip", "w") as archive:
        archive.write(toy, "20230605/rtmpose_onnx/end2end.onnx")
        archive.writestr("20230605/detail.json", "{}")
    monkeypatch.setattr("pooch.os_cache", lambda name: tmp_path / "cache" / name)
    handler = partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    handler.log_message = lambda *_: None
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


def _network(url: str, toy: Path, **changes: str) -> Network:
    digest = hashlib.sha256(toy.read_bytes()).hexdigest()
    return Network(**{
        "name": "toy", "given": "--detector FILE.onnx", "about": "a toy", "url": url, "sha256": digest,
        "megabytes": 0.1, "licence": "MIT-0", **changes,
    })  # fmt: skip


@pytest.mark.parametrize("name", ["toy.onnx", "toy.zip"])
def test_a_network_is_downloaded_once_and_its_licence_shown(served, toy, capsys, name):
    network = _network(f"{served}/{name}", toy)
    assert network.open().read_bytes() == toy.read_bytes()
    assert "licence: MIT-0" in capsys.readouterr().err
    assert _network(f"{served}/gone", toy).open() == network.path
    assert capsys.readouterr().err == ""
    assert [path.name for path in network.path.parent.iterdir()] == ["toy.onnx"]


@pytest.mark.parametrize(
    ("name", "changes"), [("toy.onnx", {"sha256": "0" * 64}), ("gone.onnx", {}), ("gone.zip", {})]
)
def test_a_network_that_cannot_be_had(served, toy, name, changes):
    network = _network(f"{served}/{name}", toy, **changes)
    with refused("not-reached", network.url, network.sha256, network.path, "--detector FILE.onnx"):
        network.open()
    assert not network.path.exists()


def test_without_a_network_one_sentence_says_what_to_do(walk_film, tmp_path, call, monkeypatch):
    def refuse(*_, **__):
        raise OSError("no network")

    monkeypatch.setattr("pooch.os_cache", lambda name: tmp_path / "cache" / name)
    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(networks, "_download_onnx", refuse)
    path = tmp_path / "cache/pcnet3d/movenet.onnx"
    result = call(walk_film.path, "-o", tmp_path / "out")
    commands.refused(result, MOVENET.url, MOVENET.sha256, path, "--detector FILE.onnx")
    assert not (tmp_path / "out").exists()
