"""How long `pcnet3d live` takes from a captured image to its pose, and where the time goes:  pcnet3d bench live"""

from __future__ import annotations

import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import ExitStack
from functools import wraps
from pathlib import Path
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import typer

from ....examples.walker.long_video import write_long_video
from ....pipeline.core.device import computing_on
from ....pipeline.reading.settings import OnDevice
from ....stages.study.live.frames import Networks, Watch
from ....stages.study.live.recording import LiveRecording, live_recording
from ....stages.study.live.source import Incoming, open_source
from ...detector.load import load_detector
from ...detector.video import Search
from ...gravity.live import LiveRectifier
from ...lifter.live import LiveLifter
from .run import gemm_gflops

_PARTS = (
    ("2D network", Search, "look"),
    ("lifter", LiveLifter, "update"),
    ("rectifier", LiveRectifier, "update"),
    ("recording, beside it", LiveRecording, "_write"),
)
_SECONDS = 30.0  # of the walker's video
_FIRST = 30  # frames that are not counted: networks warm up, and the lifter's window fills


def live(
    video: Annotated[
        Path | None, typer.Argument(help="A video; by default one of the walker is made.")
    ] = None,
    detector: Annotated[str, typer.Option(help="As for `live`.")] = "movenet",
    device: OnDevice = "auto",
) -> None:
    """Measure live on a video that is played at its own speed, and on one whose images wait."""
    print(f"matrix products: {gemm_gflops():.0f} GFLOP/s in float32")
    with tempfile.TemporaryDirectory() as folder, computing_on(device):
        if video is None:
            video = Path(folder) / "walker.mp4"
            write_long_video(video, _SECONDS)
        for realtime in (True, False):
            spent, seen, dropped, wall_s = measured_live(video, detector, realtime)
            played = "at its own speed" if realtime else "as fast as it goes"
            print(f"{played}: {seen} frames in {wall_s:.1f} s, {dropped} dropped")
            for what, ms in spent.items():
                p50, p95 = np.percentile(ms[_FIRST:] or ms, (50, 95))
                print(f"  {what}: {p50:.1f} ms (p50), {p95:.1f} ms (p95)")


def measured_live(
    video: Path, detector: str, realtime: bool
) -> tuple[dict[str, list[float]], int, int, float]:
    """Milliseconds of every frame, from capture to pose and by part; frames, dropped ones, seconds in all."""
    spent: dict[str, list[float]] = defaultdict(list)
    watch = Watch(Networks(load_detector(detector), "pcnet", None, ()))
    incoming, start = Incoming(open_source(str(video), realtime)), time.perf_counter()
    with ExitStack() as stack:
        path = Path(stack.enter_context(tempfile.TemporaryDirectory())) / "live.rrd"
        layout = load_detector(detector).layout
        recording = stack.enter_context(live_recording(path, layout, None, True))
        for what, owner, name in _PARTS:
            stack.enter_context(patch.object(owner, name, _timed(getattr(owner, name), spent[what])))
        for shot in incoming.until(lambda: False):
            moment = watch.see(shot, incoming.dropped)
            recording.log(shot, moment.found, moment.joints, moment.live)
        recording.close()
    return (
        {"from capture to pose": watch.latency.ms, **spent},
        len(watch.latency.ms),
        incoming.dropped,
        time.perf_counter() - start,
    )


def _timed(method: Callable[..., Any], spent: list[float]) -> Callable[..., Any]:
    @wraps(method)
    def timed(*args: Any, **told: Any) -> Any:
        start = time.perf_counter()
        answer = method(*args, **told)
        spent.append(1000 * (time.perf_counter() - start))
        return answer

    return timed
