"""What is given as a video opens nothing else: no address that stands in it is asked."""

import socket
import threading
from pathlib import Path

import pytest

from golden.films import film
from pcnet3d.adapters import video
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.files.video_frames import opened
from pcnet3d.stages.study.live.frames import open_source
from refusals import refused

_HLS = "#EXTM3U\n#EXT-X-VERSION:3\n#EXT-X-TARGETDURATION:2\n#EXTINF:2,\n{address}/x.ts\n#EXT-X-ENDLIST\n"
_DASH = (
    '<?xml version="1.0"?><MPD xmlns="urn:mpeg:dash:schema:mpd:2011" profiles="urn:mpeg:dash:profile:isoff-live:2011" '
    'type="static" mediaPresentationDuration="PT2S"><Period><AdaptationSet mimeType="video/mp4"><Representation id="1" '
    'bandwidth="1"><BaseURL>{address}/x.mp4</BaseURL><SegmentBase/></Representation></AdaptationSet></Period></MPD>'
)
_CONCAT = "ffconcat version 1.0\nfile '{address}/x.ts'\n"
_REDIRECT = "[Reference]\nRef1={address}/x.ts\n"
_PLAYLISTS = {"m3u8": _HLS, "mpd": _DASH, "ffconcat": _CONCAT, "asx": _REDIRECT}


@pytest.fixture
def listener():
    """An address on this machine, and a list that has an entry for everyone who connects to it."""
    asked = []
    with socket.create_server(("127.0.0.1", 0)) as server:

        def listen():
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                asked.append(connection.getsockname())
                connection.close()

        threading.Thread(target=listen, daemon=True).start()
        yield f"http://127.0.0.1:{server.getsockname()[1]}", asked
        server.shutdown(socket.SHUT_RDWR)


@pytest.mark.parametrize("kind", _PLAYLISTS)
@pytest.mark.parametrize("ending", ["own", "ts", "mp4"])
def test_a_playlist_in_a_file_connects_to_nothing(tmp_path, listener, kind, ending):
    from av.error import FFmpegError

    address, asked = listener
    path = tmp_path / f"clip.{kind if ending == 'own' else ending}"
    path.write_text(_PLAYLISTS[kind].format(address=address))
    with pytest.raises(InputError):
        video.read(path)
    with pytest.raises(InputError):
        open_source(str(path))
    with pytest.raises(FFmpegError):  # even where its first bytes had passed
        opened(path)
    assert not asked


def test_live_asks_no_address(listener):
    address, asked = listener
    with refused("unsafe", address):
        open_source(f"{address}/live.ts")
    assert not asked


def test_a_name_that_looks_like_an_address_is_a_file(tmp_path, monkeypatch, listener):
    asked = listener[1]
    monkeypatch.chdir(tmp_path)
    name = "concat:other.mp4"
    film(tmp_path / "whole.mp4", range(0, 400, 40)).rename(tmp_path / name)
    assert len(video.read(tmp_path / name)[0].time_s) == 10
    with opened(Path(name)) as container:
        assert container.streams.video
    assert not asked
