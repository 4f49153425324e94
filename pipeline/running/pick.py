"""`pcnet3d run --person pick`: who is in the input, on one sheet, so that one of them can be chosen."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from ..core.device import computing_on
from ..core.errors import InputError
from ..core.messages import how_many, say, show
from ..core.take import Video
from ..files.detections import load_detections
from ..files.names import KEYPOINTS
from ..inspect.contact_sheet import MOST, Shown, draw_people
from ..reading.bounds import timed
from ..reading.settings import RunOptions
from ..reading.take import open_people, open_take
from .recipe import Recipe


def pick(options: RunOptions, output: Path, recipe: Recipe) -> None:
    """Write the sheet of all people beside the folder that a run would make, and say how to go on.

    They have the names that --person takes. recipe: of the run; of a video alone its stage `detect` looks for people.
    InputError as for the run.
    """
    options = options.with_(person=None)
    people, video = _everybody(options, recipe)
    sheet = output.with_name(f"{output.name}-people.png")
    sheet.parent.mkdir(parents=True, exist_ok=True)
    draw_people(people, None if options.no_frames else video, sheet)
    for one in people:
        show(f"person {one.name}: {one.words}")
    if len(people) > MOST:
        say("note", f"The sheet shows the {MOST} who are seen longest.")
    print(f"{how_many(len(people), 'person', 'people')} in {sheet}; to go on, give --person NAME")


def _everybody(options: RunOptions, recipe: Recipe) -> tuple[Sequence[Shown], Video | None]:
    if options.poses is None and options.keypoints is None:
        take = open_take(options)
        with TemporaryDirectory() as folder, computing_on(options.device):
            recipe.only("detect").with_options("detect", folder=Path(folder)).build()(take)
            tracks = load_detections(Path(folder) / KEYPOINTS).people()
        if options.fps is not None:
            tracks = tuple(timed(track, options.fps) for track in tracks)
        return [Shown(track.person, track) for track in tracks], take.video
    found, video = [], None
    for person in open_people(options):
        if isinstance(person.take, InputError):
            found.append(Shown(person.name, None, str(person.take)))
            continue
        video = person.take.video
        found.append(Shown(person.name, person.take.keypoints or person.take.poses))
    return found, video
