"""Video: real time stamps, rotation, and files that are cut off or no video at all."""

from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from golden.films import film, film_of
from pcnet3d.adapters import video
from pcnet3d.pipeline import InputError
from pcnet3d.pipeline.core.take import Video
from pcnet3d.pipeline.files.video_frames import _Film, images_at
from pcnet3d.pipeline.inspect.inspect import inspect_video
from pcnet3d.pipeline.reading.load import read_video
from refusals import refused

VARIABLE = [0, 33, 66, 133, 140, 200, 300, 333, 366, 400, 433, 500]


@pytest.mark.parametrize("reordered", [0, 2])
@pytest.mark.parametrize("ending", ["mp4", "mov", "mkv"])
def test_variable_rate_in_display_order(tmp_path, ending, reordered):
    """reordered: B-frames, which are stored before frames that are shown earlier."""
    path = film(tmp_path / f"clip.{ending}", VARIABLE, reordered=reordered)
    (clip,) = video.read(path)
    np.testing.assert_allclose(clip.time_s, np.array(VARIABLE) / 1000, atol=1e-9)
    assert (clip.path, clip.width, clip.height, clip.codec, clip.rotation_deg) == (path, 64, 48, "h264", 0)


def test_frames_of_avi_are_numbered_as_they_are_shown():
    """DivX and Xvid files with B-frames were refused: FFmpeg's times of showing go 1, 4, 3, 6, 5."""
    stamps = [(1, 2), (4, 3), (3, 4), (6, 5), (5, 6), (8, None)]
    frames = [SimpleNamespace(pts=pts, dts=dts) for pts, dts in stamps]

    def decode(video):
        return iter(frames)

    container = SimpleNamespace(
        streams=SimpleNamespace(video=[SimpleNamespace(time_base=Fraction(1, 30))]),
        format=SimpleNamespace(name="avi"), decode=decode, seek=lambda *_, **__: None,
    )  # fmt: skip
    clip = Video(path=Path("clip.avi"), width=64, height=48, time_s=np.arange(7) / 30, codec="mpeg4")
    numbers, shown = zip(*_Film(clip, container).frames_from(0), strict=True)
    assert (numbers, shown) == ((0, 1, 2, 3, 4, 5), tuple(frames))


def test_first_frame_is_time_zero(tmp_path):
    """A transport stream's clock does not begin at 0."""
    (clip,) = video.read(film(tmp_path / "clip.ts", range(0, 400, 40), first_ms=700))
    np.testing.assert_allclose(clip.time_s, np.arange(10) * 0.04, atol=1e-9)
    assert clip.fps == pytest.approx(25)


def test_frames_before_the_edit_list_are_left_out(tmp_path):
    """Three of twelve frames lie before time 0; decoders drop them, so frame numbers must not count them."""
    import av

    path = film(tmp_path / "cut.mp4", [33 * i for i in range(12)], first_ms=-99, avoid_negative_ts="disabled")
    (clip,) = video.read(path)
    with av.open(path) as container:
        decoded = sum(1 for _ in container.decode(video=0))
    assert len(clip.time_s) == decoded == 9
    np.testing.assert_allclose(clip.time_s, np.arange(9) * 0.033, atol=1e-9)


@pytest.mark.parametrize("clockwise", [0, 90, 180, 270])
def test_rotation(tmp_path, clockwise):
    """OpenCV, which counts clockwise as well, is the witness."""
    cv2 = pytest.importorskip("cv2")
    path = film(tmp_path / "turned.mp4", range(0, 400, 40), rotation=-clockwise)
    (clip,) = video.read(path)
    assert clip.rotation_deg == clockwise
    assert (clip.width, clip.height) == (64, 48)
    assert cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_ORIENTATION_META) == clockwise


@pytest.mark.parametrize("ending", ["mp4", "mkv", "ts"])
def test_pixels_that_are_not_square_are_refused(tmp_path, ending):
    """As of HDV, 1440 x 1080 shown as 16:9; re-encoded videos of odd sizes are nearly square and fine."""
    path = film(tmp_path / f"hdv.{ending}", range(0, 400, 40), pixels=Fraction(4, 3))
    with pytest.raises(InputError, match=r"square pixels.*1\.33 times as wide.*setsar=1"):
        video.read(path)
    assert len(video.read(film(tmp_path / f"odd.{ending}", range(0, 400, 40), pixels=Fraction(1280, 1279))))


def test_codec_is_the_format_not_the_decoder(tmp_path):
    """AV1 is decoded by libdav1d and VP8 by whichever library is built in."""
    assert video.read(film(tmp_path / "clip.webm", range(0, 200, 40), codec="libvpx"))[0].codec == "vp8"
    assert video.read(film(tmp_path / "clip.avi", range(0, 200, 40), codec="mpeg4"))[0].codec == "mpeg4"


def test_cut_off_before_its_index(tmp_path):
    """An .mp4 whose index would have stood at the end: recognised, but it cannot be opened."""
    path = film(tmp_path / "clip.mp4", range(0, 4000, 40))
    path.write_bytes(path.read_bytes()[:-1500])
    assert video.sniff(path)
    with pytest.raises(InputError, match=r"cannot be read.*cut off or damaged"):
        video.read(path)


@pytest.mark.parametrize("share", [0.6, 0.9])
def test_cut_off_after_its_index(tmp_path, share):
    """An .mp4 with its index at the front opens, and promises frames that are not there."""
    path = film(tmp_path / "clip.mp4", range(0, 4000, 40), movflags="faststart")
    assert len(video.read(path)[0].time_s) == 100
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match="cut off"):
        video.read(path)


@pytest.mark.parametrize("stamps", [range(0, 4000, 40), range(0, 12000, 1000)])
@pytest.mark.parametrize("ending", ["mkv", "flv"])
def test_cut_off_without_an_index(tmp_path, ending, stamps):
    """The header still says how long it was; half of a recording went through as a whole one."""
    import av

    path = film(tmp_path / f"clip.{ending}", stamps)
    assert video.read(path)[0].doubts == ()
    with av.open(path) as container:
        places = [packet.pos for packet in container.demux(video=0) if packet.size]
    path.write_bytes(path.read_bytes()[: places[len(places) // 2]])
    (doubt,) = video.read(path)[0].doubts
    assert doubt.code == "video-damaged"
    assert 0.45 < doubt.values["ends_s"] / doubt.values["stated_s"] < 0.7
    assert doubt.text in str(inspect_video(path))


@pytest.mark.parametrize("ending", ["mp4", "mov", "mkv", "webm", "avi", "flv", "ts", "wmv"])
def test_a_whole_video_is_not_doubted(tmp_path, ending):
    codecs = {"webm": "libvpx", "wmv": "wmv2", "avi": "mpeg4"}
    path = film(
        tmp_path / f"clip.{ending}", range(0, 4000, 40), codec=codecs.get(ending, "libx264"), first_ms=900
    )
    assert video.read(path)[0].doubts == ()


def silence(container, stream, parts: int, rate_hz: int) -> None:
    import av

    for i in range(parts):
        part = av.AudioFrame.from_ndarray(np.zeros((2, 1024), np.float32), format="fltp", layout="stereo")
        part.sample_rate, part.pts = rate_hz, 1024 * i
        container.mux(stream.encode(part))
    container.mux(stream.encode())


def test_sound_that_goes_on_is_no_cut(tmp_path):
    """FLV says how long all of it is, and no more."""
    import av

    path = tmp_path / "long.flv"
    with av.open(path, "w") as container:
        images, sound = container.add_stream("libx264", rate=25), container.add_stream("aac", rate=44100)
        images.width, images.height, images.pix_fmt = 64, 48, "yuv420p"
        for _ in range(50):
            container.mux(
                images.encode(av.VideoFrame.from_ndarray(np.zeros((48, 64, 3), np.uint8), format="rgb24"))
            )
        container.mux(images.encode())
        silence(container, sound, 200, 44100)  # 4.6 s
    assert video.read(path)[0].doubts == ()


def test_sound_alone(tmp_path):
    import av

    path = tmp_path / "sound.mp4"
    with av.open(path, "w") as container:
        stream = container.add_stream("aac", rate=8000)
        silence(container, stream, 5, 8000)
    with pytest.raises(InputError, match="no video stream"):
        video.read(path)


def test_of_a_folder_of_images_a_video_is_to_be_made(tmp_path):
    with refused("cannot-open", "ffmpeg -framerate"):
        read_video(tmp_path)


@pytest.mark.parametrize("options", [{}, {"x264-params": "tff=1"}])
def test_interlaced_images_are_named(tmp_path, options):
    path = film_of(tmp_path / "clip.mp4", [np.zeros((48, 64, 3), np.uint8)] * 9, range(0, 360, 40), **options)
    assert [said.code for said in video.read(path)[0].doubts] == ["interlaced"] * bool(options)


def test_a_gif(tmp_path):
    grey = [np.full((48, 64, 3), 30 * i, np.uint8) for i in range(8)]
    (clip,) = video.read(film_of(tmp_path / "walk.gif", grey, range(0, 800, 100), "gif"))
    np.testing.assert_allclose(clip.time_s, np.arange(8) / 10, atol=1e-9)
    assert abs(int(images_at(clip, [5])[5][0, 0, 0]) - 150) < 40


@pytest.mark.data("video")
@pytest.mark.parametrize(
    ("name", "frames", "size", "codec"),
    [("walk_crop", 98, (884, 300), "mpeg4"), ("sports2d_demo", 230, (1768, 994), "vp9")],
)
def test_real_files(data, name, frames, size, codec):
    (clip,) = video.read(data / "video" / f"{name}.mp4")
    assert ((clip.width, clip.height), clip.codec, clip.rotation_deg) == (size, codec, 0)
    np.testing.assert_allclose(clip.time_s, np.arange(frames) / 30, atol=1e-9)


@pytest.mark.parametrize(
    ("stated", "found"), [("240", 240), ("119.880119", 119.880119), ("fast", None), ("0", None)]
)
def test_slow_motion_that_a_phone_tags(tmp_path, stated, found):
    import av

    plain, tagged = film(tmp_path / "plain.mp4", range(0, 330, 33)), tmp_path / "tagged.mp4"
    with av.open(plain) as source, av.open(tagged, "w", options={"movflags": "use_metadata_tags"}) as target:
        target.metadata["com.android.capture.fps"] = stated
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.dts is not None:
                packet.stream = stream
                target.mux(packet)
    assert video.read(plain)[0].capture_fps is None
    assert video.read(tagged)[0].capture_fps == found
