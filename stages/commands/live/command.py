"""`pcnet3d live`: a camera, a stream or a pipe, estimated, lifted, rectified and recorded while it runs."""

from __future__ import annotations

import shlex
import sys
from collections import Counter
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ....models.detector.load import PersonKind, load_detector
from ....models.detector.protocols import Detector, Found
from ....models.detector.video import Search
from ....models.gravity.live import LiveRectifier
from ....models.lifter.live import LiveLifter
from ....pipeline.errors import InputError
from ....pipeline.files.atomic import whole_folder
from ....pipeline.files.detections import KEYPOINTS
from ....pipeline.files.viewer import following
from ....pipeline.reading.take import Sources
from ....pipeline.running.interrupt import interruptible
from ....pipeline.running.progress import now_and_then, stages, tell
from ....pipeline.running.recipe import load_recipe
from ....pipeline.running.run import run_into
from .recording import live_recording
from .source import Incoming, Source, open_source

LIVE = "live.rrd"
_VIDEO = "video.ts"
_LOST = 30  # frames without the person who is shown, after which another may be


def live(
    source: Annotated[
        str, typer.Argument(help="A camera's number or device, a URL, - for a pipe, or a video file.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")],
    detector: Annotated[str, typer.Option(help="As of `run`.")] = "movenet",
    person_detector: Annotated[str | None, typer.Option(help="As of `run`.")] = None,
    person_kind: Annotated[PersonKind, typer.Option(help="As of `run`.")] = "yolox",
    focal: Annotated[float | None, typer.Option(help="Focal length in pixels.")] = None,
    stature: Annotated[float | None, typer.Option(help="The person's height in metres.")] = None,
    rectifier: Annotated[str, typer.Option(help="As of `run`.")] = "pcnet",
    view: Annotated[bool, typer.Option("--view", help="Open the viewer meanwhile.")] = False,
    web: Annotated[
        bool, typer.Option("--web", help="Show it meanwhile in a browser on this machine.")
    ] = False,
    no_frames: Annotated[bool, typer.Option("--no-frames", help="Keep pictures of the person out.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace a folder that is not ours.")] = False,
) -> None:
    """Record a person before a camera upright while it runs; Ctrl-C ends the take, which is then processed as by `run`.

    A frame's pose rests on what came before it; no frame is waited for. Pictures of a camera that come too fast are
    dropped, those of a pipe or a file wait.
    """
    shown = open_source(source)
    networks = _Networks(
        load_detector(detector, person_detector, person_kind),
        rectifier,
        focal,
    )
    inputs = [] if shown.video is None else [shown.video.path]
    with whole_folder(output, force, inputs) as folder:
        watching = following(folder / LIVE, web) if view or web else nullcontext()
        with watching:
            seen = _watch(shown, networks, folder, frames=not no_frames)
        print(f"live: {seen.words}", file=sys.stderr)
        if seen.sources is None:
            raise InputError(
                f"Nobody was found in {seen.words} of {shown.name} by {networks.detector.method}."
            )
        recipe = load_recipe().starting_with("lift").with_options("rectify", rectifier=rectifier)
        recipe = recipe.with_options("lift", image_size=seen.size, focal_px=focal)
        recipe = recipe.with_options("scale", stature_m=stature)
        if no_frames:
            recipe = recipe.with_options("record", frames=False).with_options("report", frames=False)
        try:
            with stages(["read", *(entry.use for entry in recipe.stages)]) as done:
                tell(run_into(folder, seen.sources, recipe, done))
        except (InputError, KeyboardInterrupt) as error:
            print(
                f"warning: recorded, but not processed as a take: {error or 'interrupted'}", file=sys.stderr
            )
    print(f"{output}: {', '.join(sorted(path.name for path in output.iterdir()))}")
    print(f"look at it with: pcnet3d view {shlex.quote(str(output))}, or {shlex.quote(str(output / LIVE))}")


@dataclass(frozen=True, eq=False)
class _Networks:
    detector: Detector
    rectifier: str
    focal_px: float | None


@dataclass(frozen=True)
class _Seen:
    """What was watched: in words, the picture's width and height, and the files it is processed from, if anybody was
    there."""

    words: str
    size: tuple[int, int]
    sources: Sources | None


def _watch(shown: Source, networks: _Networks, folder: Path, frames: bool) -> _Seen:
    """Every picture of a source until it ends or Ctrl-C: LIVE, the video unless it is a file, and KEYPOINTS."""
    detector = networks.detector
    search, person = Search(detector), _Followed()
    rectifier = LiveRectifier(networks.rectifier)
    lifter, size = None, (0, 0)
    incoming = Incoming(shown)
    own_video = folder / _VIDEO if shown.video is None and frames else None
    total = None if shown.video is None else len(shown.video.time_s)
    with (
        live_recording(folder / LIVE, detector.layout, own_video, frames) as recording,
        interruptible() as asked,
        now_and_then("live", total) as count,
    ):
        for shot in incoming.until(asked):
            cuts = len(search.cuts)
            found = person.choose(shot.number, search.look(shot.number, shot.time_s, shot.picture))
            if lifter is None or len(search.cuts) > cuts:
                size = shot.picture.shape[1::-1]
                lifter = LiveLifter(detector.layout, size, networks.focal_px)
                rectifier = LiveRectifier(networks.rectifier)
            missing = np.full((len(detector.layout), 2), np.nan)
            xy, score = (missing, missing[:, 0]) if found is None else (found.xy, found.score)
            joints = lifter.update(xy, score)
            recording.log(shot, found, joints, rectifier.update(joints, shot.time_s))
            count(search.seen)
        recording.close()
    if incoming.broke is not None:
        print(f"warning: {incoming.broke} What came before is kept.", file=sys.stderr)
    words = f"{search.seen} frames"
    if not shown.waits:
        words += f", {incoming.dropped} dropped to keep up"
    if not person.shown:
        return _Seen(words, size, None)
    search.detections(total or search.seen, search.seen).save(folder / KEYPOINTS)
    sources = Sources(
        keypoints=folder / KEYPOINTS,
        video=shown.video.path if shown.video is not None else own_video,
        person=str(person.shown.most_common(1)[0][0]),
    )
    return _Seen(words, size, sources)


@dataclass
class _Followed:
    """Who is shown: the first who came, until not seen for _LOST frames; then the largest."""

    name: int | None = None
    last: int = 0
    shown: Counter[int] = field(default_factory=Counter)

    def choose(self, number: int, people: Sequence[tuple[int, Found]]) -> Found | None:
        """The one of a frame's people, by their names."""
        named = dict(people)
        if self.name not in named and (self.name is None or number - self.last > _LOST) and named:
            self.name = max(named, key=lambda name: float(np.prod(named[name].box[2:] - named[name].box[:2])))
        if self.name is None or self.name not in named:
            return None
        self.last = number
        self.shown[self.name] += 1
        return named[self.name]
