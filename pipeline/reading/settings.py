"""The options of a run, which `run`, `live` and `batch` share: one field each, with its help and its place in the help.

A field without a place on the command line is given as `--set read.FIELD=VALUE`, a stage's own option as
`--set STAGE.KEY=VALUE`, and one of the keypoints' adapter as `--set keypoints.KEY=VALUE`.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from datetime import date
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, get_args, get_origin

import typer
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    InstanceOf,
    ValidationError,
)
from typer.models import ParameterInfo

from ..core.device import Device
from ..core.errors import InputError
from ..core.take import Check, Handedness, Session, Told
from ..files.atomic import printable
from ..plugins.options import did_you_mean, pairs
from ..plugins.removed import refuse_removed
from .load import Source

OFF = "off"  # as the value of a whole stage: leave it out
READ, KEYPOINTS = "read", "keypoints"  # not stages, but what --set names like them

# Fields that are told of the recording and are no stage's option, by their names in pipeline.core.take.Told.
TOLD = {
    "fps": "fps", "person": "person", "stature": "stature_m", "camera": "camera", "focal": "focal_px",
    "image_size": "image_size", "pitch": "pitch_deg", "roll": "roll_deg", "gravity": "gravity",
    "handedness": "handedness", "check": "check",
}  # fmt: skip
# Fields that are short for `--set` of a STAGE.KEY.
SHORT = {"detector": "detect.detector", "lifter": "lift.lifter", "also": "export.also"}
_FORMS = {  # of fields that are given as one text, for errors
    "time_range": "START:END in seconds, START before END, such as 2.5:8",
    "image_size": "WIDTHxHEIGHT",
    "gravity": "X,Y,Z",
    "date": "YYYY-MM-DD such as 2026-03-31",
}


def _panel(name: str) -> Callable[..., Any]:
    """Makes options of that part of the help: of a help text, and names on the command line if not the field's own."""
    return lambda text, *names: typer.Option(*names, help=text, rich_help_panel=name)


_input, _person, _camera, _output = map(_panel, ("Input", "Person", "Camera", "Output"))


def _parts(separator: str) -> BeforeValidator:
    """Of a text the parts between the separators, each of which pydantic reads."""
    return BeforeValidator(lambda value: value.lower().split(separator) if isinstance(value, str) else value)


def _date(value: Any) -> Any:
    return value if value is None else date.fromisoformat(str(value)).isoformat()


def _ends(value: Any) -> Any:
    """Of a text both ends, of which either may lack; ValueError for more or fewer."""
    if not isinstance(value, str):
        return value
    return [end or usual for end, usual in zip(value.split(":"), ("0", "inf"), strict=True)]


def _in_order(span: tuple[float, float] | None) -> tuple[float, float] | None:
    if span is not None and not span[0] < span[1]:
        raise ValueError
    return span


def _pairs(value: Any) -> Any:
    return dict(value) if isinstance(value, Mapping) else pairs(value)


Output = Annotated[Path, _output("Folder for the results.", "-o", "--output")]
Force = Annotated[bool, _output("Overwrite the output folder even if pcnet3d did not create it.", "--force")]
Resume = Annotated[bool, _output("Continue an interrupted detection in this output folder.", "--resume")]
OnDevice = Annotated[
    Device,
    _input("Device for the networks; auto takes the first of `pcnet3d list devices` that works.", "--device"),
]


class RunOptions(BaseModel):
    """What a run is made from and how: files, and everything a user says about them.

    Text, as from a command line or a manifest, becomes numbers, paths and pairs. settings: values of stages' own
    options by "STAGE.KEY", and "off" by the name of a stage to leave out; "read.FIELD" and "keypoints.KEY"
    become the fields that they name. InputError for an unknown option and for a value of another type.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    video: Annotated[Path | None, typer.Argument(help="The recorded video.")] = None
    poses: Annotated[Path | None, _input("3D poses from a lifter: a file or a folder.")] = None
    adapter: Annotated[str, _input("Format of --poses: a name from `pcnet3d list adapters`.")] = "auto"
    options: Annotated[
        dict[str, Any],
        BeforeValidator(_pairs),
        _input("Option KEY=VALUE for reading --poses; repeatable.", "-O", "--option"),
    ] = {}
    keypoints: Annotated[Path | None, _input("2D keypoints: a file or a folder.")] = None
    fps: Annotated[
        float | None,
        _input("Frames per second, if no file states them or the stated rate is wrong (slow motion)."),
    ] = None
    time_range: Annotated[
        tuple[float, Annotated[float, AllowInfNan()]] | None,
        BeforeValidator(_ends),
        AfterValidator(_in_order),
        _input("Process only this part: START:END in seconds, such as 2.5:8, 2: or :8."),
    ] = None
    detector: Annotated[
        str | None,
        _input("Network that finds joints in the video: a name from `pcnet3d list models`, or a file."),
    ] = None
    lifter: Annotated[
        str | None,
        _input(
            "Lifter to use without --poses: a name from `pcnet3d list models`, or an .onnx file of `lab train`."
        ),
    ] = None
    device: OnDevice = "auto"
    person: Annotated[str | None, _person("Which person: an ID in the file, longest or largest.")] = None
    everyone: Annotated[
        bool, _person("Process everybody who is visible, each into a folder.", "--everyone")
    ] = False
    stature: Annotated[float | None, _person("The person's height in metres; it sets the scale.")] = None
    camera: Annotated[
        str | None, _camera("static or moving; by default the background of the video decides.")
    ] = None
    focal: Annotated[float | None, _camera("Focal length in pixels, if known.")] = None
    also: Annotated[
        tuple[str, ...],
        _output("Format to write too: a name from `pcnet3d list writers`, such as csv or c3d; repeatable."),
    ] = ()
    no_frames: Annotated[bool, _output("Keep images of the person out of the results.", "--no-frames")] = (
        False  # of Told.images
    )
    recipe: Annotated[Path | None, _output("TOML file that lists the stages and their options.")] = None
    settings: Annotated[
        dict[str, Any],
        _output("STAGE.KEY=VALUE sets an option of a stage; STAGE=off skips the stage; repeatable.", "--set"),
    ] = {}

    # Without a place of their own on the command line. The first three head the report; gravity is in the camera's axes
    # (x right, y down, z forward), pitch positive looking down, roll if the image turns counter-clockwise.
    title: str | None = None
    person_id: str | None = None
    date: Annotated[str | None, BeforeValidator(_date)] = None
    image_size: Annotated[tuple[int, int] | None, _parts("x")] = None
    pitch: float | None = None
    roll: float | None = None
    gravity: Annotated[tuple[float, float, float] | None, _parts(",")] = None
    handedness: Handedness = "refuse"
    check: Check = "refuse"
    first_frame: int | None = None
    keypoints_adapter: str = "auto"
    keypoints_person: str | None = None
    keypoints_options: Annotated[dict[str, Any], BeforeValidator(_pairs)] = {}
    # "poses", "keypoints": instead of files; their labels stand there.
    in_memory: dict[str, InstanceOf[Source]] = {}

    def __init__(self, **given: Any) -> None:
        given = _distributed(given)
        try:
            super().__init__(**given)
        except ValidationError as error:
            raise _refusal(error, given) from None

    def with_(self, **changes: Any) -> RunOptions:
        """A copy with other values in these fields."""
        return self.model_copy(update=changes)

    @property
    def told(self) -> Told:
        """What is told of the recording. InputError for what cannot be."""
        fields = {of_told: getattr(self, name) for name, of_told in TOLD.items()}
        return Told(**fields, images=not self.no_frames)

    @property
    def session(self) -> Session:
        """What heads the report."""
        return Session(*(printable(text or "") for text in (self.title, self.person_id, self.date)))


# Of the fields that have an option of their own.
PLACES: dict[str, ParameterInfo] = {
    name: each
    for name, field in RunOptions.model_fields.items()
    for each in field.metadata
    if isinstance(each, ParameterInfo)
}


def reading_options() -> tuple[str, ...]:
    """The fields that are given as `read.FIELD`."""
    own = {*PLACES, "keypoints_options", "in_memory"}
    return tuple(name for name in RunOptions.model_fields if name not in own)


def flag_of(name: str) -> str:
    """As a user types it."""
    if name not in PLACES:
        return f"--set {KEYPOINTS}" if name == "keypoints_options" else f"--set {READ}.{name}"
    longest = [flag for flag in getattr(PLACES[name], "param_decls", None) or () if flag.startswith("--")]
    return longest[0] if longest else "--" + name.replace("_", "-")


def _distributed(given: Mapping[str, Any]) -> dict[str, Any]:
    """The fields with what `settings` says about reading in its place."""
    fields = dict(given)
    settings = fields.pop("settings", None) or {}
    settings = dict(settings) if isinstance(settings, Mapping) else pairs(settings, "--set")
    stages: dict[str, Any] = {}
    keypoints = {}
    for name, value in settings.items():
        refuse_removed("settings", name, f"{name}={value}")
        part, dot, key = name.partition(".")
        if part == READ:
            if key not in reading_options():
                hint = f"it is {flag_of(key)}." if key in PLACES else did_you_mean(key, reading_options())
                raise InputError("name-unknown", f"--set {name}: there is no such option; {hint}")
            fields[key] = value
        elif part == KEYPOINTS and dot:
            keypoints[key] = value
        elif not dot and value != OFF:
            column = name.lstrip("-").replace("-", "_")
            hint = (
                f"{name} is {flag_of(column)}"
                if column in RunOptions.model_fields
                else f"got '{name}={value}'"
            )
            raise InputError("bad-value", f"Expected --set STAGE.KEY=VALUE, or STAGE={OFF}; {hint}.")
        else:
            stages[name] = value
    if keypoints:
        fields["keypoints_options"] = {**_pairs(fields.get("keypoints_options", {})), **keypoints}
    return {**fields, "settings": stages} if stages else fields


def _refusal(error: ValidationError, given: Mapping[str, Any]) -> InputError:
    """given: the fields as they were given."""
    first = error.errors()[0]
    cause, name = first.get("ctx", {}).get("error"), str(first["loc"][0])
    if isinstance(cause, InputError):
        return cause
    if first["type"] == "extra_forbidden":
        refuse_removed("settings", f"{READ}.{name}")
        hint = did_you_mean(name, RunOptions.model_fields)
        return InputError("name-unknown", f"A run has no option '{name}'; {hint}")
    if name in _FORMS:
        return InputError("bad-value", f"Expected {flag_of(name)}={_FORMS[name]}, got '{given[name]}'.")
    return InputError("bad-value", f"{flag_of(name)}={first['input']}: {first['msg']}.")


def offering(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Decorator of a command whose first parameter is the RunOptions: on the command line it has those fields as
    options, besides its own; without names all of them."""

    def decorate(function: Callable[..., None]) -> Callable[..., None]:
        shown = names or tuple(PLACES)
        own = list(inspect.signature(function, eval_str=True).parameters.values())[1:]
        shared = [_parameter(name) for name in shown]
        own = [parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY) for parameter in own]

        @wraps(function)
        def command(**given: Any) -> None:
            options = {name: value for name in shown if (value := given.pop(name, None)) is not None}
            function(RunOptions(**options), **given)

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


def _parameter(name: str) -> inspect.Parameter:
    field = RunOptions.model_fields[name]
    default = None if isinstance(field.default, dict | tuple) else field.default
    annotation = Annotated[_typer_type(field.annotation), PLACES[name]]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)
