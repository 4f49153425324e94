"""`pcnet3d live`: a camera, a stream or a pipe, estimated, lifted, rectified and recorded while it runs."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from ....models.detector.load import load_detector
from ....models.detector.protocols import Detector, Found
from ....models.detector.video import Search
from ....models.gravity import Evidence, fuse, told_up
from ....models.gravity.live import LiveRectifier
from ....models.lifter.live import LiveLifter
from ....pipeline.core.device import computing_on
from ....pipeline.core.errors import InputError
from ....pipeline.core.messages import how_many, say, show
from ....pipeline.core.system import quoted
from ....pipeline.core.take import Told
from ....pipeline.files.atomic import add_to_summary, whole_folder
from ....pipeline.files.names import KEYPOINTS
from ....pipeline.files.viewer import following
from ....pipeline.plugins.options import call
from ....pipeline.reading.flags import Force, Output, offering
from ....pipeline.reading.settings import RunOptions
from ....pipeline.running.conclusion import conclude, point_to, show_files
from ....pipeline.running.interrupt import interruptible
from ....pipeline.running.plan import planned
from ....pipeline.running.progress import now_and_then, stages, tell
from ....pipeline.running.recipe import Recipe
from ....pipeline.running.run import check_plan, inputs_of, run_into
from ...detect import Detect
from ...rectify import Rectify
from .recording import live_recording
from .source import Incoming, Source, open_source

LIVE = "live.rrd"
_VIDEO = "video.ts"
_KNOWN = ("detector", "person_detector", "person_kind", "looks")  # of the options of detect
_LOST = 30  # frames without the person who is shown, after which another may be


@offering(
    "detector", "device", "stature", "focal", "also", "no_frames", "recipe", "settings"
)  # fmt: skip
def live(
    options: RunOptions,
    source: Annotated[
        str, typer.Argument(help="A camera's number or device, a URL, - for a pipe, or a video file.")
    ],
    output: Output,
    view: Annotated[bool, typer.Option("--view", help="Open the viewer meanwhile.")] = False,
    web: Annotated[
        bool, typer.Option("--web", help="Show it meanwhile in a browser on this machine.")
    ] = False,
    force: Force = False,
) -> None:
    """Process a live camera or stream; on Ctrl-C run the full pipeline on the recording.

    Each pose uses the frames up to its own, so there is no delay. Images of a camera that come too fast are dropped;
    those of a pipe or a file wait.
    """
    shown = open_source(source)
    frames = not options.no_frames
    asked = planned(options.with_(video=Path(source)))  # of a run with the source for its video
    detect = _detect(asked)
    inputs = inputs_of(options.with_(video=None if shown.video is None else shown.video.path), asked)
    with computing_on(options.device) as where, whole_folder(output, force, inputs) as folder:
        video = shown.video.path if shown.video else folder / _VIDEO if frames else None
        recorded = _recorded(options, folder / KEYPOINTS, video)
        _check_end(recorded)
        networks = _networks(asked, detect, options.told)
        watching = following(folder / LIVE, web) if view or web else nullcontext()
        with watching:
            seen = _watch(shown, networks, folder, frames)
        say("live", seen.words)
        take = fault = None
        try:
            if seen.person is None:
                raise InputError(
                    "nothing-usable",
                    f"Nobody was found in {seen.words} of {shown.name} by {networks.detector.method}.",
                )
            size = seen.size if video is None else None  # a video has its own; that of ours is even
            recorded = recorded.with_(person=seen.person, image_size=size)
            recipe = _end(recorded)
            with stages(["read", *(entry.use for entry in recipe.stages)]) as done:
                (run,) = run_into(folder, recorded, recipe, done)
            take = run.take
            assert take is not None
            tell(take)
        except (InputError, KeyboardInterrupt) as error:
            if seen.person is None and (video is None or shown.video or not any(seen.size)):  # none is kept
                raise
            say("warning", f"recorded, but not processed as a take: {error or 'interrupted'}")
        except Exception as error:  # nothing of ours may cost a recording that cannot be made again
            fault = error
            say("warning", "recorded, but not processed as a take: a fault of this program, below.")
        add_to_summary(folder, device=where.summary())
    show_files(output)
    if fault is not None:
        raise fault
    shown_then = f"what was known at the time: pcnet3d view {quoted(output / LIVE)}"
    if take is None:
        print(shown_then)
        return
    show(shown_then)
    conclude({"": take})
    point_to(output)


def _detect(recipe: Recipe) -> Detect:
    """The stage that looks while the camera runs. InputError where the recipe has none, or options of it that are of
    whole videos and would go unheard."""
    told = next((entry.options for entry in recipe.stages if entry.use == "detect"), None)
    if told is None:
        raise InputError(
            "option-conflict", "Expected somebody to be looked for by live, got detect=off; leave it out."
        )
    detect = call(Detect, what="Stage 'detect'", options=told)
    if unheard := [f"detect.{name}" for name in told if name not in _KNOWN]:
        raise InputError(
            "option-conflict",
            f"Expected for live no options of detect but {', '.join(_KNOWN)}, got {', '.join(unheard)}; leave it out, "
            "or give it to a run of the video afterwards.",
        )
    return detect


def _recorded(options: RunOptions, keypoints: Path, video: Path | None) -> RunOptions:
    """The run at the end, but for the person and the image's size, which are not known before."""
    others = {name: value for name, value in options.settings.items() if not name.startswith("detect.")}
    return options.with_(keypoints=keypoints, video=video, detector=None, settings=others)


def _end(recorded: RunOptions) -> Recipe:
    """The recipe of the run at the end, in which nobody is looked for again."""
    recipe = planned(recorded)
    return recipe.without("detect") if recipe.has("detect") else recipe


def _check_end(recorded: RunOptions) -> None:
    """InputError when the run at the end cannot work, before the camera runs."""
    given = ["keypoints"] if recorded.video is None else ["keypoints", "video"]
    try:
        check_plan(_end(recorded), recorded.told, *given)
    except InputError as error:
        raise InputError(
            error.code, f"live ends with a run of its {' and its '.join(given)}: {error}"
        ) from None


@dataclass(frozen=True, eq=False)
class _Networks:
    """told: what the user tells about up, which nothing contradicts while the camera runs: the run at the end does."""

    detector: Detector
    rectifier: str
    focal_px: float | None
    told: Sequence[Evidence]

    def for_camera(self, image_size: tuple[int, int]) -> tuple[LiveLifter, LiveRectifier]:
        """Of a camera, or of another one behind a cut."""
        return self.for_person(image_size), LiveRectifier(self.rectifier, self.told)

    def for_person(self, image_size: tuple[int, int]) -> LiveLifter:
        """Of another person: the lift of one rests on no keypoints of another. It may rest on an up that is told."""
        up = fuse(self.told).up if self.told else None
        return LiveLifter(self.detector.layout, image_size, self.focal_px, up=up)


def _networks(recipe: Recipe, detect: Detect, told: Told) -> _Networks:
    """Those that a run by the recipe would use."""
    options = {entry.use: entry.options for entry in recipe.stages}
    rectify = Rectify(**options.get("rectify", {}))
    looks = 1 if detect.looks is None else detect.looks  # one is quickest
    detector = load_detector(detect.detector, detect.person_detector, detect.person_kind, looks)
    return _Networks(detector, rectify.rectifier, told.focal_px, told_up(told))


@dataclass(frozen=True)
class _Seen:
    """What was watched: in words, the image's width and height, and, if anybody was there, who was shown most."""

    words: str
    size: tuple[int, int]
    person: str | None


def _watch(shown: Source, networks: _Networks, folder: Path, frames: bool) -> _Seen:
    """Every image of a source until it ends or Ctrl-C: LIVE, the video unless it is a file, and KEYPOINTS."""
    detector = networks.detector
    search, person = Search(detector), _Followed()
    estimators, size = None, (0, 0)
    incoming = Incoming(shown)
    own_video = folder / _VIDEO if shown.video is None and frames else None
    total = None if shown.video is None else len(shown.video.time_s)
    with (
        live_recording(folder / LIVE, detector.layout, own_video, frames) as recording,
        interruptible() as asked,
        now_and_then("live", total) as count,
    ):
        for shot in incoming.until(asked):
            cuts, before = len(search.cuts), person.name
            found = person.choose(shot.number, search.look(shot.number, shot.time_s, shot.image))
            if estimators is None or len(search.cuts) > cuts:
                size = shot.image.shape[1::-1]
                estimators = networks.for_camera(size)
            elif before not in (None, person.name):
                estimators = networks.for_person(size), estimators[1]
            lifter, rectifier = estimators
            missing = np.full((len(detector.layout), 2), np.nan)
            xy, score = (missing, missing[:, 0]) if found is None else (found.xy, found.score)
            joints = lifter.update(xy, score, shot.time_s)
            recording.log(shot, found, joints, rectifier.update(joints, shot.time_s))
            count(search.seen)
        recording.close()
    if incoming.broke is not None:
        say("warning", f"{incoming.broke} What came before is kept.")
    words = how_many(search.seen, "frame")
    if not shown.waits:
        words += f", {incoming.dropped} dropped to keep up"
    if not person.shown:
        return _Seen(words, size, None)
    everybody = search.detections(total or search.seen, search.seen)
    everybody.save(folder / KEYPOINTS)
    most = str(person.shown.most_common(1)[0][0])
    if (people := len(np.unique(everybody.person))) > 1:
        words += f"; of {people} people person {most}, who was shown most, is taken"
    return _Seen(words, size, most)


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
