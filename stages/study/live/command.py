"""`pcnet3d live`: a camera, estimated, lifted and rectified while it runs, and recorded for `pcnet3d run`."""

from __future__ import annotations

import json
import os
import sys
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, nullcontext, redirect_stdout
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ....models.detector.load import load_detector
from ....models.detector.scene_cuts import without_repeats
from ....models.gravity.evidence import told_up
from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many, say
from ....pipeline.core.system import quoted
from ....pipeline.files.atomic import add_to_summary, require_space, whole_folder
from ....pipeline.files.names import KEYPOINTS
from ....pipeline.plugins.options import call
from ....pipeline.reading.settings import Force, Output, RunOptions, flag_of, offering
from ....pipeline.running.progress import counted, interruptible
from ...detect import Detect
from ...drawing.rerun_video import TICK, h264_stream
from ...rectify import Rectify
from .frames import LivePose, Shot, Source, Watch, open_source

_VIDEO = "video.ts"
# What is left on the disk when live ends there: the encoder's last images, the ends of the files and the summary; and
# of each frame its keypoints.
_RESERVE_BYTES, _FRAME_BYTES = 16 << 20, 400
_BEHIND = 2  # images that wait for the encoder: enough for an uneven one; more would be memory and no gain
_OPTIONS = ("detector", "device", "focal", "no_frames", "settings")
# What --set may name: what is done while the camera runs.
_SETTINGS = (
    "detect.detector", "detect.person_detector", "detect.looks", "rectify.rectifier",
    "read.gravity", "read.pitch", "read.roll",
)  # fmt: skip

Send = Callable[[LivePose], None]


@offering(*_OPTIONS)
def live(
    options: RunOptions,
    source: Annotated[str, typer.Argument(help="Number or device of a camera, or a video file.")],
    output: Output,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print every pose as a line of JSON on standard output.")
    ] = False,
    force: Force = False,
) -> None:
    """Process a live camera until Ctrl-C, and record it for `pcnet3d run`.

    Each pose uses its own frame and earlier ones, so there is no delay. Images of a camera that come too fast are
    dropped and counted; images of a file wait. The command ends before the disk is full, and keeps what it has
    recorded.
    """
    send = _printing() if as_json else None
    with redirect_stdout(sys.stderr) if as_json else nullcontext():
        shown = open_source(source)
        inputs = [] if shown.video is None else [shown.video.path]
        with computing_on(options.device) as where, whole_folder(output, force, inputs) as folder:
            watch = _watch(options)
            summary, full = _recorded(shown, watch, folder, not options.no_frames, send)
            add_to_summary(folder, device=where.summary(), live=summary)
        if not watch.person.shown:
            raise InputError(
                "nothing-usable",
                f"Nobody was found in {how_many(summary['frames'], 'frame')} of {shown.name} by "
                f"{watch.detector.method}; the recording is kept in {output}.",
            )
        print(f"for angles and a report: {_run_of(shown, watch, output, not options.no_frames)}")
        if full is not None:
            raise full


def _printing() -> Send:
    """A callback that prints a pose as a line of JSON on standard output; a reader that is gone is told of once.
    InputError where standard output is closed."""
    if sys.stdout is None:
        raise InputError("not-reached", "--json prints on standard output, but that is closed.")
    descriptor, gone = sys.stdout.fileno(), False

    def send(pose: LivePose) -> None:
        nonlocal gone
        line = json.dumps(pose.as_dict(), allow_nan=False, separators=(",", ":")).encode() + b"\n"
        try:
            while line and not gone:
                line = line[os.write(descriptor, line) :]
        except OSError as error:
            gone = True
            say("warning", f"standard output is closed ({error.strerror}); live goes on without it.")

    return send


def _watch(options: RunOptions) -> Watch:
    """With the networks that a run with these options would use. InputError for a setting that live has no use for."""
    fields = [flag_of(name).removeprefix("--set ") for name in options.model_fields_set - {*_OPTIONS}]
    unheard = [name for name in (*fields, *options.settings) if name not in _SETTINGS]
    if unheard:
        raise InputError(
            "option-conflict",
            f"Expected live to have only these settings: {', '.join(_SETTINGS)}, got {', '.join(unheard)}; leave it "
            "out, or give it to a later run of the recording.",
        )
    given: dict[str, dict[str, Any]] = {"detect": {}, "rectify": {}}
    if options.detector is not None:
        given["detect"]["detector"] = options.detector
    for name, value in options.settings.items():
        stage, _, key = name.partition(".")
        given[stage][key] = value
    detect = call(Detect, what="Stage 'detect'", options=given["detect"])
    rectify = call(Rectify, what="Stage 'rectify'", options=given["rectify"])
    looks = 1 if detect.looks is None else detect.looks  # one is quickest
    detector = load_detector(detect.detector, detect.person_detector, looks)
    return Watch(detector, rectify.rectifier, options.focal, told_up(options.told))


def _full(folder: Path, frames: int) -> InputError | None:
    """The refusal where a folder's disk has no room for more than the end of so many frames."""
    try:
        require_space(folder.parent, _RESERVE_BYTES + _FRAME_BYTES * frames, "The end of what live records")
    except InputError as error:
        return error
    return None


def _recorded(
    shown: Source, watch: Watch, folder: Path, frames: bool, send: Send | None
) -> tuple[dict[str, Any], InputError | None]:
    """Every image of a source until it ends or Ctrl-C: poses sent, the video unless it is a file, KEYPOINTS. With the
    entry `live` of summary.json, and the refusal for which it ended where the disk is nearly full. frames: whether
    images may be kept."""
    own_video = folder / _VIDEO if frames and shown.video is None else None
    total = None if shown.video is None else len(shown.video.time_s)
    if (full := _full(folder, 0)) is not None:
        raise full
    with (
        interruptible() as asked,
        _film(own_video) as keep,
        counted("live", total) as count,
    ):
        for shot in shown.until(asked):
            pose = watch.see(shot, shown.dropped)
            if send is not None:
                send(pose)  # before anything is written
            keep(shot)
            count(watch.search.seen, f", latency {pose.latency_ms:.0f} ms, {pose.dropped} dropped")
            if (full := _full(folder, watch.search.seen)) is not None:
                break
    if shown.broke is not None:
        say("warning", f"{shown.broke} What came before is kept.")
    summary: dict[str, Any] = {"frames": len(watch.latency_ms), "dropped": shown.dropped}
    latency = ""
    if watch.latency_ms:
        p50, p95 = (round(float(each), 2) for each in np.percentile(watch.latency_ms, (50, 95)))
        summary |= {"latency_p50_ms": p50, "latency_p95_ms": p95}
        latency = f", latency {p50:.0f} ms (p50), {p95:.0f} ms (p95)"
    say("live", f"{how_many(summary['frames'], 'frame')}, {summary['dropped']} dropped{latency}")
    if watch.person.shown:
        search = watch.search
        without_repeats(search.detections(total or search.seen, search.seen)).save(folder / KEYPOINTS)
    return summary, full


@contextmanager
def _film(path: Path | None) -> Iterator[Callable[[Shot], None]]:
    """A function that keeps an image in an MPEG-TS file, which is whole however the block ends; without a path it does
    nothing. Encoding takes about as long as finding the pose in the next image, so a thread does it; where that is
    _BEHIND images behind, it is waited for. InputError when the file cannot be written."""
    if path is None:
        yield lambda shot: None
        return
    import av
    from av.error import FFmpegError

    encoder, pending = None, deque[Future[None]]()

    def write(shot: Shot) -> None:
        nonlocal encoder
        height, width = (side // 2 * 2 for side in shot.image.shape[:2])  # yuv420p needs even sizes
        encoder = encoder or h264_stream(target, width, height, 30)
        image = av.VideoFrame.from_ndarray(np.ascontiguousarray(shot.image[:height, :width]), "rgb24")
        image.pts, image.time_base = round(shot.time_s / TICK), TICK
        target.mux(encoder.encode(image))

    def keep(shot: Shot) -> None:
        pending.append(beside.submit(write, shot))
        while len(pending) > _BEHIND:
            pending.popleft().result()

    # The thread ends, with all that it was given, before the file is closed.
    try:
        with av.open(str(path), "w", format="mpegts") as target, ThreadPoolExecutor(1, "film") as beside:
            yield keep
            while pending:
                pending.popleft().result()
            if encoder is not None:
                target.mux(encoder.encode(None))
    except FFmpegError as error:
        raise InputError(
            "cannot-write", f"The video {path} could not be written: {error.strerror}."
        ) from None


def _run_of(shown: Source, watch: Watch, output: Path, frames: bool) -> str:
    """The command that processes what was recorded, of the person who was shown most."""
    width, height = watch.size
    video = None if shown.video is None else shown.video.path
    if video is None and frames:
        video = output / _VIDEO
    image = [f"--set read.image_size={width}x{height}"] if video is None else [quoted(video)]
    (person, _), *others = watch.person.shown.most_common()
    chosen = [f"--person {person}"] * bool(others)
    return " ".join(
        ["pcnet3d run", *image, f"--keypoints {quoted(output / KEYPOINTS)}", *chosen, "-o results"]
    )
