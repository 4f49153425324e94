"""A video as long as one likes: the walker comes, squats, raises both arms, and goes the same way back, again and
again."""

from __future__ import annotations

from fractions import Fraction
from itertools import cycle
from pathlib import Path

from .camera import side_camera
from .image import images
from .walk import walker


def write_long_video(path: Path, seconds: float) -> None:
    """640 x 360 pixels, 30 frames a second, H.264 in MP4. The way there and back is encoded once, the rest are copies
    of its packets."""
    import av

    walk = walker()
    frames, there = round(seconds * walk.fps), range(len(walk))
    shown = images(walk, side_camera(walk), [*there, *reversed(there)][:frames])
    with av.open(str(path), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(walk.fps).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = 640, 360, "yuv420p"
        stream.options = {"crf": "21", "preset": "fast", "bf": "0", "g": "60"}
        packets = []
        for number, drawn in enumerate(shown):
            image = av.VideoFrame.from_ndarray(drawn, format="rgb24")
            image.pts, image.time_base = number, Fraction(1, 30)
            packets += stream.encode(image)
        packets += stream.encode()
        step = packets[1].pts - packets[0].pts
        contents = [(bytes(packet), packet.is_keyframe) for packet in packets]
        for number, (content, key) in zip(range(frames), cycle(contents)):
            packet = av.Packet(content)
            packet.stream, packet.time_base, packet.is_keyframe = stream, packets[0].time_base, key
            packet.pts = packet.dts = number * step
            container.mux(packet)
