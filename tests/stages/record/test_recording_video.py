"""The video is in the recording as it is where the viewer can play it, and a faithful copy where not."""

import io
from dataclasses import replace

import av
import numpy as np
import pytest

from pcnet3d.adapters import video as video_adapter
from pcnet3d.stages.drawing.rerun_video import transcoded, viewable
from pcnet3d.stages.record.stage import record
from refusals import refused

BLOB, STAMP, PART = "AssetVideo:blob", "VideoFrameReference:timestamp", "VideoFrameReference:video_reference"
UNEVEN_MS = (0, 33, 66, 133, 140, 200, 300, 333, 366, 400, 433, 500)


def mp4(part) -> io.BytesIO:
    return io.BytesIO(part.asset.blob.as_arrow_array().values.to_numpy().tobytes())


def packets_of(source) -> list[bytes]:
    with av.open(source) as container:
        return [bytes(packet) for packet in container.demux(video=0) if packet.size]


def frames_of(source) -> tuple[list[float], np.ndarray]:
    """Seconds and images (N, H, W) in grey of a video."""
    with av.open(source) as container:
        stream = container.streams.video[0]
        frames = list(container.decode(stream))
        return [frame.time for frame in frames], np.stack(
            [frame.to_ndarray(format="gray") for frame in frames]
        )


def spot(images: np.ndarray) -> np.ndarray:
    """(N, 2) column and row of the bright spot."""
    weight = (images > 128).astype(float)
    total = weight.sum(axis=(1, 2))
    rows, columns = np.indices(images.shape[1:])
    return np.stack([(weight * axis).sum(axis=(1, 2)) / total for axis in (columns, rows)], axis=1)


@pytest.mark.parametrize(
    ("codec", "name", "bf"),
    [
        ("libx264", "film.mp4", 0),
        ("libx264", "film.mp4", 2),
        ("libx264", "film.MOV", 2),
        ("libvpx-vp9", "film.mp4", 0),
    ],
)
def test_playable_video_keeps_its_packets(taken, film, codec, name, bf):
    video = film(codec, name, bf=bf)
    recording = taken(video=video)[1]
    own = io.BytesIO(bytes(recording.static("video_parts/0", BLOB)[0]))
    assert packets_of(own) == packets_of(video.path)
    frame, nanoseconds, references = recording.over_time("video", STAMP)
    assert frame.tolist() == list(range(20))
    np.testing.assert_allclose(nanoseconds / 1e9, video.time_s, atol=1e-9)
    stamps = np.ravel(references)
    np.testing.assert_allclose((stamps - stamps[0]) / 1e9, video.time_s, atol=2e-6)
    assert "Video and 2D keypoints" in recording.blueprint("ViewBlueprint:display_name")


@pytest.mark.parametrize(("codec", "name"), [("mpeg4", "film.mp4"), ("ffv1", "film.avi")])
def test_other_video_is_transcoded_once(taken, film, codec, name):
    video = film(codec, name)
    recording = taken(video=video)[1]
    time_s, images = frames_of(io.BytesIO(bytes(recording.static("video_parts/0", BLOB)[0])))
    np.testing.assert_allclose(time_s, video.time_s, atol=1e-4)
    np.testing.assert_allclose(spot(images), spot(frames_of(video.path)[1]), atol=0.3)
    np.testing.assert_allclose(
        np.ravel(recording.over_time("video", STAMP)[2]) / 1e9, video.time_s, atol=1e-4
    )


@pytest.mark.parametrize("bf", [0, 2])
def test_long_video_is_cut_at_key_frames_and_its_packets_are_untouched(taken, film, monkeypatch, bf):
    monkeypatch.setattr("pcnet3d.stages.drawing.rerun_video.PART_BYTES", 1)
    video = film(bf=bf, time_ms=range(0, 1200, 40), group=5)
    recording = taken(video=video)[1]
    frame, nanoseconds, stamps, entities = [], [], [], []
    for batch in recording.batches("video", STAMP, static=False):
        frame += batch.column("frame").to_pylist()
        nanoseconds += batch.column("video_time").cast("int64").to_pylist()
        stamps += np.ravel(batch.column(STAMP).to_pylist()).tolist()
        entities += np.ravel(batch.column(PART).to_pylist()).tolist()
    order = np.argsort(frame)
    assert np.array(frame)[order].tolist() == list(range(30))
    np.testing.assert_allclose(np.array(nanoseconds)[order] / 1e9, video.time_s, atol=1e-9)
    parts = sorted(set(entities), key=lambda name: int(name.rpartition("/")[2]))
    assert len(parts) >= 3
    packets, images = [], []
    for part in parts:
        content = bytes(recording.static(part.strip("/"), BLOB)[0])
        packets += packets_of(io.BytesIO(content))
        seconds, shown = frames_of(io.BytesIO(content))
        own = np.sort([stamp for stamp, entity in zip(stamps, entities, strict=True) if entity == part])
        assert len(seconds) == len(own)
        np.testing.assert_allclose(own / 1e9 - own[0] / 1e9, np.subtract(seconds, seconds[0]), atol=2e-6)
        images.append(shown)
    assert packets == packets_of(video.path)
    assert np.array_equal(np.concatenate(images), frames_of(video.path)[1])


def test_parts_keep_uneven_time_stamps(film, monkeypatch):
    monkeypatch.setattr("pcnet3d.stages.drawing.rerun_video.PART_BYTES", 1)
    video = film(time_ms=UNEVEN_MS, group=5)
    parts = viewable(video)
    found = [part.stamps_ns / 1e9 for part in parts]
    for start, stamps in zip((0, 5, 10), found, strict=True):
        of_part = video.time_s[start : start + 5]
        np.testing.assert_allclose(stamps - stamps[0], of_part - of_part[0], atol=2e-6)


def test_key_frames_that_earlier_frames_need_end_no_part(film, monkeypatch):
    """An open group's first images come before its key frame and are built on the group before."""
    monkeypatch.setattr("pcnet3d.stages.drawing.rerun_video.PART_BYTES", 1)
    options = {"x265-params": "open-gop=1:scenecut=0:keyint=6:min-keyint=6:log-level=none"}
    video = film("libx265", time_ms=range(0, 1600, 40), bf=2, group=6, **options)
    (own,) = viewable(video)
    assert len(own.stamps_ns) == 40
    monkeypatch.setattr("pcnet3d.stages.drawing.rerun_video._MOST_BYTES", 1)
    parts = [*viewable(video)]
    assert packets_of(mp4(parts[0])) != packets_of(mp4(own))  # a copy
    assert sum(len(part.stamps_ns) for part in parts) == 40


def test_copy_keeps_uneven_time_stamps_and_names_its_rate(film):
    """The viewer starts FFmpeg on the bare stream and never hears of frames when that claims 90k of them a second."""
    video = film("mpeg4", time_ms=UNEVEN_MS)
    (copy,) = transcoded(video)
    np.testing.assert_allclose(frames_of(mp4(copy))[0], video.time_s, atol=2e-5)
    with av.open(mp4(copy)) as container:
        stream = container.streams.video[0]
        next(container.decode(stream))
        assert stream.codec_context.codec.canonical_name == "h264"
        assert not stream.codec_context.has_b_frames
        assert float(stream.codec_context.framerate) == pytest.approx(video.fps, rel=0.01)


@pytest.mark.parametrize("clockwise", [90, 180, 270])
def test_turned_video_comes_out_upright(film, clockwise):
    video = replace(film(time_ms=range(0, 280, 40)), rotation_deg=clockwise)
    (part,) = viewable(video)
    upright = np.rot90(frames_of(video.path)[1], -clockwise // 90, axes=(1, 2))
    _, images = frames_of(mp4(part))
    assert images.shape == upright.shape
    np.testing.assert_allclose(spot(images), spot(upright), atol=0.3)


def test_frames_that_an_edit_list_cuts_away_do_not_shift_the_rest(film, tmp_path):
    """Three of twelve frames lie before time 0: players skip them, the viewer would count them."""
    whole, path = film(time_ms=[40 * i for i in range(12)], bf=0), tmp_path / "cut.mp4"
    with (
        av.open(whole.path) as source,
        av.open(path, "w", options={"avoid_negative_ts": "disabled"}) as target,
    ):
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(video=0):
            if packet.size:
                packet.stream = stream
                packet.pts, packet.dts = (int(t - 0.12 / packet.time_base) for t in (packet.pts, packet.dts))
                target.mux(packet)
    (video,) = video_adapter.read(path)
    assert len(video.time_s) == 9
    (part,) = viewable(video)
    stamps = part.stamps_ns
    np.testing.assert_allclose((stamps - stamps[0]) / 1e9, video.time_s, atol=1e-4)
    _, shown = frames_of(path)
    _, images = frames_of(mp4(part))
    np.testing.assert_allclose(spot(images), spot(shown), atol=0.3)


def test_slow_motion_runs_with_the_poses(make_take, read_back, film):
    """The file claims 25 frames a second, the user says 100: video, keypoints and poses stay together."""
    take = make_take().with_(video=film())
    slow = {"time_s": take.poses.frame_index / 100}
    rectified = replace(take.rectified, level=take.rectified.level.with_(**slow))
    take = take.with_(
        poses=take.poses.with_(**slow), keypoints=take.keypoints.with_(**slow), rectified=rectified
    )
    recording = read_back(take)
    for entity, component in (("video", STAMP), ("level/joints", "Points3D:positions")):
        frame, nanoseconds, _ = recording.over_time(entity, component)
        np.testing.assert_allclose(nanoseconds / 1e9, frame / 100, atol=1e-9)


def test_no_frames_means_no_image(taken, film):
    recording = taken(frames=False, video=film("mpeg4"))[1]
    assert "video" not in recording.entities
    assert not any("AssetVideo:blob" in chunk.to_record_batch().schema.names for chunk in recording.chunks)
    assert "2D keypoints" in recording.blueprint("ViewBlueprint:display_name")


def test_video_that_ends_with_the_poses_still_running(make_take, read_back, film):
    """No row of NaN behind the poses when nothing goes on without them; one when the video does."""
    for length, ends in ((17, 16), (18, 17)):
        take = make_take().with_(video=film(time_ms=range(0, 40 * length, 40)))
        frame, _, positions = read_back(take).over_time("level/joints", "Points3D:positions")
        assert frame[-1] == ends
        assert np.isnan(positions[-1]).all() == (ends == 17)


def test_broken_video_is_refused(film, make_take, tmp_path):
    video = film("mpeg4")
    video.path.write_bytes(b"no video at all" * 99)
    with refused("file-damaged"):
        record(make_take().with_(video=video), tmp_path / "take.rrd")
    assert [file.name for file in tmp_path.iterdir()] == ["film.mp4"]


def test_of_a_part_only_its_frames_are_there(taken, film):
    video = replace(film(time_ms=range(0, 480, 40)), part=(3, 8))
    recording = taken(video=video)[1]
    frames, seconds, _ = recording.over_time("video", STAMP)
    assert list(frames) == list(range(3, 9))
    np.testing.assert_allclose(seconds / 1e9, video.time_s[3:9], atol=1e-6)
    parts = list(transcoded(video))
    shown = np.concatenate([frames_of(mp4(part))[1] for part in parts])
    np.testing.assert_allclose(spot(shown), spot(frames_of(video.path)[1])[3:9], atol=0.3)
