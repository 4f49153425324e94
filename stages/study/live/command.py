"""`pcnet3d live`: a camera, estimated, lifted, rectified and recorded while it runs."""

from __future__ import annotations

import sys
from contextlib import nullcontext, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ....models.detector.load import load_detector
from ....models.detector.repeated import without_repeats
from ....models.gravity import told_up
from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many, say, show
from ....pipeline.core.system import quoted
from ....pipeline.core.take import Told
from ....pipeline.files.atomic import add_to_list, add_to_summary, require_space, whole_folder
from ....pipeline.files.names import KEYPOINTS
from ....pipeline.files.viewer import following
from ....pipeline.plugins.options import call
from ....pipeline.reading.flags import Force, Output, offering
from ....pipeline.reading.settings import RunOptions
from ....pipeline.running.conclusion import conclude
from ....pipeline.running.interrupt import interruptible
from ....pipeline.running.plan import planned
from ....pipeline.running.progress import counted, stages
from ....pipeline.running.recipe import Recipe
from ....pipeline.running.run import check_plan, inputs_of, run_files
from ...detect import Detect
from ...rectify import Rectify
from .frames import LivePose, Networks, Watch, percentiles
from .lines import Send, json_lines
from .recording import live_recording
from .source import Incoming, Source, open_source

LIVE, TAKE = "live.rrd", "take"
_VIDEO = "video.ts"
# What is left on the disk when live ends there: the encoder's last images, the ends of the files and the summary; and
# of each frame its keypoints.
_RESERVE_BYTES, _FRAME_BYTES = 16 << 20, 400
_KNOWN = ("detector", "person_detector", "person_kind", "looks")  # of the options of detect


@offering(
    "detector", "device", "stature", "focal", "also", "no_frames", "recipe", "settings"
)  # fmt: skip
def live(
    options: RunOptions,
    source: Annotated[str, typer.Argument(help="Number or device of a camera, or a video file.")],
    output: Output,
    view: Annotated[bool, typer.Option("--view", help="Open the viewer while it runs.")] = False,
    web: Annotated[bool, typer.Option("--web", help="Open the viewer in a browser on this machine.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print every pose as a line of JSON on standard output.")
    ] = False,
    force: Force = False,
) -> None:
    """Process a live camera until Ctrl-C, then run the whole pipeline on the recording, into its folder `take`.

    Each pose uses its own frame and earlier ones, so there is no delay. Images of a camera that come too fast are
    dropped and counted; images of a file wait. The command ends before the disk is full, and keeps what it has
    recorded.
    """
    sending = json_lines() if as_json else nullcontext(lambda pose: None)
    with sending as send, redirect_stdout(sys.stderr) if as_json else nullcontext():
        _live(options, open_source(source), source, output, view or web, web, force, send)


def _live(
    options: RunOptions,
    shown: Source,
    source: str,
    output: Path,
    view: bool,
    web: bool,
    force: bool,
    send: Send,
) -> None:
    frames = not options.no_frames
    asked = planned(options.with_(video=Path(source)))  # of a run with the source for its video
    detect = _detect(asked)
    inputs = inputs_of(options.with_(video=None if shown.video is None else shown.video.path), asked)
    video = shown.video.path if shown.video else output / _VIDEO if frames else None
    # The run at the end, but for the person and the image's size, which are not known before.
    others = {name: value for name, value in options.settings.items() if not name.startswith("detect.")}
    recorded = options.with_(keypoints=output / KEYPOINTS, video=video, detector=None, settings=others)
    recipe = _of_recorded(recorded)
    with computing_on(options.device) as where, whole_folder(output, force, inputs) as folder:
        networks = _networks(asked, detect, options.told)
        with following(folder / LIVE, web) if view else nullcontext():
            seen = _watch(shown, networks, folder, frames, send)
        add_to_summary(folder, device=where.summary(), live=seen.summary)
    say("live", seen.words)
    show(f"what was known at the time: pcnet3d view {quoted(output / LIVE)}")
    if seen.person is None:
        raise InputError(
            "nothing-usable",
            f"Nobody was found in {how_many(int(seen.summary['frames']), 'frame')} of {shown.name} by "
            f"{networks.detector.method}; the recording is kept in {output}.",
        )
    size = seen.size if video is None else None  # a video has its own; that of ours is even
    recorded = recorded.with_(person=seen.person, image_size=size, recipe=None)
    with stages(["read", *(entry.use for entry in recipe.stages)]) as done:
        take = run_files(recorded, output / TAKE, recipe, done=done)
    add_to_list(output, TAKE)
    conclude({"": take}, output / TAKE)
    if seen.full is not None:
        raise seen.full


def _detect(recipe: Recipe) -> Detect:
    """The stage that looks while the camera runs. InputError where the recipe has none, or options of it that are of
    whole videos and would go unheard."""
    told = next((entry.options for entry in recipe.stages if entry.use == "detect"), None)
    if told is None:
        raise InputError("option-conflict", "Expected live to look for people, got detect=off; leave it out.")
    detect = call(Detect, what="Stage 'detect'", options=told)
    if unheard := [f"detect.{name}" for name in told if name not in _KNOWN]:
        raise InputError(
            "option-conflict",
            f"Expected live to have only these options of detect: {', '.join(_KNOWN)}, got {', '.join(unheard)}; "
            "leave it out, or give it to a later run of the video.",
        )
    return detect


def _of_recorded(recorded: RunOptions) -> Recipe:
    """The recipe of the run at the end, in which nobody is looked for again. InputError when that cannot work, before
    the camera runs."""
    given = ["keypoints"] if recorded.video is None else ["keypoints", "video"]
    try:
        recipe = planned(recorded)
        recipe = recipe.without("detect") if recipe.has("detect") else recipe
        check_plan(recipe, recorded.told, *given)
    except InputError as error:
        raise InputError(
            error.code, f"live ends with a run of its {' and its '.join(given)}: {error}"
        ) from None
    return recipe


def _networks(recipe: Recipe, detect: Detect, told: Told) -> Networks:
    """Those that a run by the recipe would use."""
    options = {entry.use: entry.options for entry in recipe.stages}
    rectify = Rectify(**options.get("rectify", {}))
    looks = 1 if detect.looks is None else detect.looks  # one is quickest
    detector = load_detector(detect.detector, detect.person_detector, detect.person_kind, looks)
    return Networks(detector, rectify.rectifier, told.focal_px, told_up(told))


@dataclass(frozen=True)
class _Seen:
    """What was watched: in words, the image's width and height, if anybody was there, who was shown most, the entry
    `live` of summary.json, and the refusal for which it ended where the disk is nearly full."""

    words: str
    size: tuple[int, int]
    person: str | None
    summary: dict[str, float]
    full: InputError | None = None


def _full(folder: Path, frames: int) -> InputError | None:
    """The refusal where a folder's disk has no room for more than the end of so many frames."""
    try:
        require_space(folder.parent, _RESERVE_BYTES + _FRAME_BYTES * frames, "The end of what live records")
    except InputError as error:
        return error
    return None


def _watch(shown: Source, networks: Networks, folder: Path, frames: bool, send: Send) -> _Seen:
    """Every image of a source until it ends or Ctrl-C: poses sent, LIVE, the video unless it is a file, KEYPOINTS."""
    watch, incoming = Watch(networks), Incoming(shown)
    own_video = folder / _VIDEO if shown.video is None and frames else None
    total = None if shown.video is None else len(shown.video.time_s)
    if (full := _full(folder, 0)) is not None:
        raise full
    with (
        live_recording(folder / LIVE, networks.detector.layout, own_video, frames) as recording,
        interruptible() as asked,
        counted("live", total) as count,
    ):
        for shot in incoming.until(asked):
            moment = watch.see(shot, incoming.dropped)
            send(moment.pose)  # before anything is written
            recording.log(shot, moment.found, moment.joints, moment.live)
            count(watch.search.seen, _state(moment.pose))
            if (full := _full(folder, watch.search.seen)) is not None:
                break
        recording.close()
    if incoming.broke is not None:
        say("warning", f"{incoming.broke} What came before is kept.")
    search, shown_as = watch.search, watch.person.shown
    said = how_many(len(watch.latency_ms), "frame")
    if not shown.waits:
        said += f", {incoming.dropped} dropped to keep up"
    summary: dict[str, float] = {"frames": len(watch.latency_ms), "dropped": incoming.dropped}
    if watch.latency_ms:
        p50, p95 = percentiles(watch.latency_ms)
        summary |= {"latency_p50_ms": round(p50, 2), "latency_p95_ms": round(p95, 2)}
        said += _latency(p50, p95)
    if not shown_as:
        return _Seen(said, watch.size, None, summary, full)
    everybody = without_repeats(search.detections(total or search.seen, search.seen))
    everybody.save(folder / KEYPOINTS)
    most = str(shown_as.most_common(1)[0][0])
    if (people := len(np.unique(everybody.person))) > 1:
        said += f"; of {people} people person {most}, who was shown most, is taken"
    return _Seen(said, watch.size, most, summary, full)


def _state(pose: LivePose) -> str:
    """Words for the line that says how it goes."""
    dropped = f", {pose.dropped} dropped" if pose.dropped else ""
    return _latency(pose.latency_p50_ms, pose.latency_p95_ms) + dropped


def _latency(p50_ms: float, p95_ms: float) -> str:
    return f", latency {p50_ms:.0f} ms (p50), {p95_ms:.0f} ms (p95)"
