"""The options of a run, which `run`, `live` and `batch` share: one field each, with its help and its place in the help.

A field without a place on the command line is given as `--set read.FIELD=VALUE`, a stage's own option as
`--set STAGE.KEY=VALUE`, and one of the keypoints' adapter as `--set keypoints.KEY=VALUE`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import date
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import typer
from pydantic import BaseModel, BeforeValidator, ConfigDict, ValidationError
from typer.models import ParameterInfo

from ..core.device import Device
from ..core.errors import InputError
from ..core.take import Told
from ..plugins.options import did_you_mean, pairs
from ..signals.swap_repair import Swaps
from .handedness import Handedness
from .normalise import Missing

OFF = "off"  # as the value of a whole stage: leave it out
READ, KEYPOINTS = "read", "keypoints"  # not stages, but what --set names like them

_INPUT, _PERSON, _CAMERA, _REPAIR, _OUTPUT = "Input", "Person", "Camera", "Repair", "Output"
_SESSION = "Session"


@dataclass(frozen=True)
class To:
    """Where a value goes: STAGE.KEY of a stage, without which the run refuses the value, and of each of `too` that it
    has."""

    first: str = ""
    too: tuple[str, ...] = ()


@dataclass(frozen=True)
class Tells:
    """That a value is no stage's option but told of the recording, as this field of pipeline.core.take.Told."""

    field: str


def _option(panel: str, text: str, *names: str) -> Any:
    return typer.Option(*names, help=text, rich_help_panel=panel)


def _size(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    width, times, height = value.lower().partition("x")
    if not (times and width.isdigit() and height.isdigit()):
        raise InputError(f"Expected --image-size WIDTHxHEIGHT such as 1920x1080, got '{value}'.")
    return int(width), int(height)


def _vector(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    try:
        x, y, z = map(float, value.split(","))
    except ValueError:
        raise InputError(f"Expected --gravity X,Y,Z such as 0,1,0, got '{value}'.") from None
    return x, y, z


def _date(value: Any) -> Any:
    try:
        return value if value is None else date.fromisoformat(str(value)).isoformat()
    except ValueError:
        raise InputError(f"Expected --date YYYY-MM-DD such as 2026-03-31, got '{value}'.") from None


def _time_range(value: Any) -> Any:
    if not isinstance(value, str):
        return value
    start, colon, end = value.partition(":")
    try:
        told = float(start or 0), float(end or "inf")
    except ValueError:
        told = ()
    if not (colon and told):
        raise InputError(f"Expected --time-range START:END in seconds, such as 2.5:8, got '{value}'.")
    if not told[0] < told[1]:
        raise InputError(f"Expected a --time-range that ends after it starts, got '{value}'.")
    return told


def _pairs(value: Any) -> Any:
    return dict(value) if isinstance(value, Mapping) else pairs(value)


Output = Annotated[Path, _option(_OUTPUT, "Folder for the results.", "-o", "--output")]
Force = Annotated[
    bool, _option(_OUTPUT, "Overwrite the output folder even if pcnet3d did not create it.", "--force")
]
Resume = Annotated[
    bool,
    _option(
        _OUTPUT, "Continue the detection or lift that was interrupted in this output folder.", "--resume"
    ),
]
Pick = Annotated[
    bool,
    _option(_PERSON, "Only draw everybody, with the IDs that --person takes, into DIR-people.png.", "--pick"),
]
OnDevice = Annotated[
    Device,
    _option(
        _INPUT,
        "Where networks compute: auto (the first of `pcnet3d list devices` that works), cpu, ...",
        "--device",
    ),
]
Strict = Annotated[
    bool,
    _option(_OUTPUT, "Exit with 3 if the poses are suspicious, 4 if unusable or not levelled.", "--strict"),
]


class RunOptions(BaseModel):
    """What a run is made from and how: files, and everything a user tells about them.

    Text, as a command line or a manifest gives it, becomes numbers, paths and pairs. settings: values of stages' own
    options by "STAGE.KEY", and "off" by the name of a stage that is to be left out; "read.FIELD" and "keypoints.KEY"
    become the fields that they name. InputError for an option that there is not and for a value of another type.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    video: Annotated[Path | None, typer.Argument(help="The recorded video.")] = None
    poses: Annotated[Path | None, _option(_INPUT, "3D poses of a lifter: a file or a folder.")] = None
    adapter: Annotated[str, _option(_INPUT, "Format of --poses; see `pcnet3d list adapters`.")] = "auto"
    options: Annotated[
        dict[str, Any],
        BeforeValidator(_pairs),
        _option(_INPUT, "KEY=VALUE for the adapter of --poses; repeatable.", "-O", "--option"),
    ] = {}
    keypoints: Annotated[Path | None, _option(_INPUT, "2D keypoints: a file or a folder.")] = None
    fps: Annotated[
        float | None,
        _option(_INPUT, "Frames a second: where no file tells, or instead of what one tells (slow motion)."),
        To(too=("detect.fps",)),
    ] = None
    time_range: Annotated[
        tuple[float, float] | None,
        BeforeValidator(_time_range),
        _option(_INPUT, "START:END in seconds of the video or file: process this part only; 2: and :8 too."),
    ] = None
    image_size: Annotated[
        tuple[int, int] | None,
        BeforeValidator(_size),
        _option(_INPUT, "WIDTHxHEIGHT in pixels, to lift keypoints without a video."),
        Tells("image_size"),
    ] = None
    detector: Annotated[
        str | None,
        _option(
            _INPUT, "Network that finds joints in the video: a name of `pcnet3d list models`, or a file."
        ),
        To("detect.detector"),
    ] = None
    lifter: Annotated[
        str | None,
        _option(_INPUT, "Lifter when --poses is absent: a name of `pcnet3d list models`, or an .onnx file."),
        To("lift.lifter"),
    ] = None
    device: OnDevice = "auto"
    person: Annotated[
        str | None,
        _option(_PERSON, "Person ID in the file, or longest, largest, all (one folder each)."),
        To(too=("detect.person",)),
    ] = None
    stature: Annotated[
        float | None,
        _option(_PERSON, "Body height in metres; sets the scale."),
        Tells("stature_m"),
    ] = None
    title: Annotated[
        str | None, _option(_SESSION, "Title of the report; without it the name of the recording.")
    ] = None
    person_id: Annotated[str | None, _option(_SESSION, "Your own ID of the person, for the report.")] = None
    date: Annotated[
        str | None, BeforeValidator(_date), _option(_SESSION, "Day of the recording, YYYY-MM-DD.")
    ] = None
    camera: Annotated[str | None, _option(_CAMERA, "static (default) or moving."), Tells("camera")] = None
    focal: Annotated[
        float | None, _option(_CAMERA, "Focal length in pixels, if known."), Tells("focal_px")
    ] = None
    pitch: Annotated[
        float | None,
        _option(_CAMERA, "Camera pitch in degrees, positive looking down; with --roll."),
        Tells("pitch_deg"),
    ] = None
    roll: Annotated[
        float | None,
        _option(
            _CAMERA,
            "Camera roll in degrees, positive if the image turns counter-clockwise; with --pitch.",
        ),
        Tells("roll_deg"),
    ] = None
    gravity: Annotated[
        tuple[float, float, float] | None,
        BeforeValidator(_vector),
        _option(_CAMERA, "Gravity direction in camera axes (x right, y down, z forward), e.g. 0,1,0."),
        Tells("gravity"),
    ] = None
    handedness: Annotated[
        Handedness,
        _option(_REPAIR, "If the skeleton looks mirrored: refuse, mirror, swap, swap-legs, ignore."),
        To(too=("lift.handedness",)),
    ] = "refuse"
    swaps: Annotated[
        Swaps,
        _option(
            _REPAIR, "If limbs are exchanged, or mirrored in depth, for some frames: report, repair, mask."
        ),
        To(too=("detect.swaps",)),
    ] = "report"
    smoother: Annotated[
        str | None,
        _option(
            _REPAIR,
            "Of wrist and ankle paths: auto (by the error of the joints; default), butterworth, savgol, none.",
        ),
        To("trajectories.smoother", ("angles.smoother",)),
    ] = None
    also: Annotated[
        tuple[str, ...],
        _option(
            _OUTPUT,
            "Further file to write: a name of `pcnet3d list writers`, such as csv or c3d; repeatable.",
        ),
        To("export.also"),
    ] = ()
    no_frames: Annotated[
        bool, _option(_OUTPUT, "Keep images of the person out of the results.", "--no-frames")
    ] = False  # of Told.images
    recipe: Annotated[Path | None, _option(_OUTPUT, "TOML file of stages and their options.")] = None
    settings: Annotated[
        dict[str, Any],
        _option(
            _OUTPUT, "STAGE.KEY=VALUE: any option of a stage; STAGE=off leaves it out; repeatable.", "--set"
        ),
    ] = {}

    # Of reading, without a place of their own on the command line.
    missing: Missing = "refuse"
    first_frame: int | None = None
    keypoints_adapter: str = "auto"
    keypoints_person: str | None = None
    keypoints_options: Annotated[dict[str, Any], BeforeValidator(_pairs)] = {}

    def __init__(self, **given: Any) -> None:
        try:
            super().__init__(**_distributed(given))
        except ValidationError as error:
            raise _refusal(error) from None

    def with_(self, **changes: Any) -> RunOptions:
        """A copy with other values in these fields."""
        return self.model_copy(update=changes)

    def goals(self) -> Iterable[tuple[str, Any, To]]:
        """Name, value and destination of each field that was given and that a stage wants."""
        for name, field in type(self).model_fields.items():
            value = getattr(self, name)
            if value != field.get_default(call_default_factory=True):
                yield from ((name, value, goal) for goal in field.metadata if isinstance(goal, To))

    @property
    def told(self) -> Told:
        """What is told of the recording. InputError for what cannot be."""
        fields = {field: getattr(self, name) for name, field in TOLD.items()}
        return Told(**fields, images=not self.no_frames)


TOLD = {
    name: told.field
    for name, field in RunOptions.model_fields.items()
    for told in field.metadata
    if isinstance(told, Tells)
}  # the options that are told of the recording, and their fields of Told


def _place(name: str) -> ParameterInfo | None:
    """How a field stands on the command line; None for one of `read`."""
    metadata = RunOptions.model_fields[name].metadata
    return next((each for each in metadata if isinstance(each, ParameterInfo)), None)


def flags() -> tuple[str, ...]:
    """The fields that have an option of their own, in the order of the help."""
    return tuple(name for name in RunOptions.model_fields if _place(name) is not None)


def reading_options() -> tuple[str, ...]:
    """The fields that are given as `read.FIELD`."""
    own = {*flags(), "keypoints_options"}
    return tuple(name for name in RunOptions.model_fields if name not in own)


def flag_of(name: str) -> str:
    """As a user types it."""
    place = _place(name)
    if place is None:
        return f"--set {READ}.{name}"
    longest = [flag for flag in getattr(place, "param_decls", None) or () if flag.startswith("--")]
    return longest[0] if longest else "--" + name.replace("_", "-")


def _distributed(given: Mapping[str, Any]) -> dict[str, Any]:
    """The fields with what `settings` says about reading in its place."""
    fields = dict(given)
    settings = fields.pop("settings", None) or {}
    settings = dict(settings) if isinstance(settings, Mapping) else pairs(settings, "--set")
    stages: dict[str, Any] = {}
    keypoints = {}
    for name, value in settings.items():
        part, dot, key = name.partition(".")
        if part == READ:
            if key not in reading_options():
                hint = f"it is {flag_of(key)}." if key in flags() else did_you_mean(key, reading_options())
                raise InputError(f"--set {name}: there is no such option; {hint}")
            fields[key] = value
        elif part == KEYPOINTS and dot:
            keypoints[key] = value
        elif not dot and value != OFF:
            column = name.lstrip("-").replace("-", "_")
            known = f"{name} is {flag_of(column)}" if column in flags() else f"got '{name}={value}'"
            raise InputError(f"Expected --set STAGE.KEY=VALUE, or STAGE={OFF}; {known}.")
        else:
            stages[name] = value
    if keypoints:
        fields["keypoints_options"] = {**_pairs(fields.get("keypoints_options", {})), **keypoints}
    return {**fields, "settings": stages} if stages else fields


def _refusal(error: ValidationError) -> InputError:
    first = error.errors()[0]
    cause, name = first.get("ctx", {}).get("error"), str(first["loc"][0])
    if isinstance(cause, InputError):
        return cause
    if first["type"] == "extra_forbidden":
        return InputError(f"A run has no option '{name}'; {did_you_mean(name, RunOptions.model_fields)}")
    return InputError(f"{flag_of(name)}={first['input']}: {first['msg']}.")


def offering(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator of a command whose first parameter is the RunOptions: on the command line it has those fields as
    options, besides its own; without names all of them."""

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        shown = names or flags()
        own = list(inspect.signature(function, eval_str=True).parameters.values())[1:]
        keyword = inspect.Parameter.KEYWORD_ONLY
        shared = [
            inspect.Parameter(name, keyword, default=_typer_default(name), annotation=_typer_annotation(name))
            for name in shown
        ]
        own = [parameter.replace(kind=keyword) for parameter in own]

        @wraps(function)
        def command(*args: Any, **given: Any) -> None:
            told = {name: given.pop(name) for name in shown if name in given}
            function(
                RunOptions(**{name: value for name, value in told.items() if value is not None}),
                *args,
                **given,
            )

        command.__signature__ = inspect.Signature([*shared, *own])  # type: ignore[attr-defined]
        command.__annotations__ = {parameter.name: parameter.annotation for parameter in (*shared, *own)}
        return command

    return decorate


def is_repeatable(name: str) -> bool:
    """Whether a field may be given several times on the command line."""
    return _typer_type(RunOptions.model_fields[name].annotation) == list[str] | None


def _typer_type(hint: Any) -> Any:
    """What typer is to read for a field of that type: pairs and lists one by one, and sizes and vectors as text."""
    parts = [hint, *get_args(hint)]
    kinds = [get_origin(part) or part for part in parts]
    if dict in kinds or Ellipsis in get_args(hint):
        return list[str] | None
    return str | None if tuple in kinds else hint


def _typer_annotation(name: str) -> Any:
    return Annotated[_typer_type(RunOptions.model_fields[name].annotation), _place(name)]


def _typer_default(name: str) -> Any:
    default = RunOptions.model_fields[name].default
    return None if isinstance(default, dict | tuple) else default


# What has gone from the command line, and how it is given now.
MOVED = {
    "--parity": "--handedness",
    "--left-right": "--handedness",
    "--missing": "--set read.missing=VALUE",
    "--first-frame": "--set read.first_frame=VALUE",
    "--keypoints-adapter": "--set read.keypoints_adapter=VALUE",
    "--keypoints-option": "--set keypoints.KEY=VALUE",
    "--person-detector": "--set detect.person_detector=VALUE",
    "--person-kind": "--set detect.person_kind=VALUE",
    "--smooth": "--set detect.smooth_hz=VALUE",
    "--lifter-kind": "--set lift.lifter_kind=VALUE",
    "--flip": "--set lift.flip=true",
    "--rectifier": "--set rectify.rectifier=VALUE",
    "--camera-file": "--set calibrate.camera_file=FILE",
    "--camera-name": "--set calibrate.camera_name=VALUE",
    "--gravity-network": "--set calibrate.gravity_network=VALUE",
    "--no-calibrate": f"--set calibrate={OFF}",
    "--cutoff": "--set trajectories.cutoff_hz=VALUE",
}
