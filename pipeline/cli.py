"""The command line: every command that a package registers, this one or another."""

from __future__ import annotations

import inspect as signatures
import io
import json
import math
import os
import signal
import sys
import traceback
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command, get_group

from .core.errors import InputError
from .core.messages import is_verbose, say, set_verbose
from .core.system import limit_opencv
from .plugins import registry
from .plugins.options import did_you_mean
from .plugins.removed import refuse_removed

_LAB = "lab"  # the commands of the laboratory stand behind this word
_HELP = {"help_option_names": ["-h", "--help"]}
_VERBOSE = ("-v", "--verbose")


class _Command(TyperCommand):
    """A command that takes finite numbers only; -v may stand behind its name too."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        words = args[: args.index("--")] if "--" in args else args
        if any(word in _VERBOSE for word in words):
            set_verbose(True)
        args = [word for word in words if word not in _VERBOSE] + args[len(words) :]
        for word, value in zip(words, [*words[1:], ""], strict=True):
            refuse_removed("flags", f"{self.name} {word.partition('=')[0]}", f"{self.name} {word} {value}")
        rest = super().parse_args(ctx, args)
        for parameter in self.params:
            value = ctx.params.get(parameter.name)
            if isinstance(value, float) and not math.isfinite(value):
                raise InputError(
                    "bad-value", f"Expected a finite number for {parameter.opts[-1]}, got {value}."
                )
        return rest


class _Commands(TyperGroup):
    """The registered commands; a package whose command cannot be loaded does not keep the others from working."""

    group = "commands"

    def list_commands(self, ctx: Any) -> list[str]:
        return sorted(registry.registered(self.group), key=lambda name: name == _LAB)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """For the help page, on which a broken one says so."""
        try:
            return load_command(cmd_name, self.group)
        except InputError as error:
            from rich.markup import escape

            return TyperCommand(cmd_name, help=escape(str(error)))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        name, names = args[0], registry.registered(self.group)
        if name not in names and not name.startswith("-"):
            refuse_removed(self.group, name)
            raise InputError("name-unknown", f"There is no command '{name}'; {did_you_mean(name, names)}")
        return name, load_command(name, self.group), args[1:]


class _LabCommands(_Commands):
    group = _LAB


def load_command(name: str, group: str = "commands") -> Any:
    """The command itself; InputError when its package is broken."""
    command = registry.load(group, name)
    if isinstance(command, typer.Typer):
        several = get_group(command)
        several.name = name
        return several
    alone = typer.Typer(add_completion=False)
    alone.command(name=name, cls=_Command, help=_flowing(command.__doc__ or ""))(command)
    return get_command(alone)


def _flowing(text: str) -> str:
    """A docstring's paragraphs in one line each, which the help page then wraps by itself."""
    return "\n\n".join(" ".join(part.split()) for part in signatures.cleandoc(text).split("\n\n"))


def _version(asked: bool) -> None:
    if asked:
        from .core.pose import package_version

        print(f"pcnet3d {package_version()}")
        raise typer.Exit


app = typer.Typer(
    name="pcnet3d",
    cls=_Commands,
    help="Turn a video of a person, or 3D poses, into kinematics that mean the same from every camera.",
    context_settings=_HELP,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
)


lab = typer.Typer(
    cls=_LabCommands,
    help="Train, measure and evaluate: for developers, and to repeat the published figures.",
    context_settings=_HELP,
    no_args_is_help=True,
)


@lab.callback()
def _laboratory() -> None:
    pass


@app.callback()
def _program(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
    verbose: Annotated[
        bool, typer.Option(*_VERBOSE, help="Print the options and the time of each stage.")
    ] = False,
) -> None:
    set_verbose(verbose)


def view(
    folder: Annotated[Path, typer.Argument(help="Folder of a run.")],
    web: Annotated[
        bool, typer.Option("--web", help="Open the recording in a browser on this machine.")
    ] = False,
) -> None:
    """Open a run's recording."""
    from .files import viewer

    viewer.view(folder, web)


def inspect(
    file: Annotated[
        Path, typer.Argument(help="3D poses, 2D keypoints (a file or a folder), a video or an image.")
    ],
    adapter: Annotated[
        str, typer.Option(help="Format of the file: a name from `pcnet3d list adapters`.")
    ] = "auto",
    person: Annotated[
        str | None,
        typer.Option(
            help="Which person: an ID in the file, longest (most frames) or largest (in the image)."
        ),
    ] = None,
    option: Annotated[
        list[str] | None,
        typer.Option("--option", "-O", help="Option KEY=VALUE for reading the file; repeatable."),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
) -> None:
    """Show what a file holds and what is wrong with it; of a video or an image also the camera's pitch, roll and focal
    length.

    Exit codes: 0 good, 3 suspicious, 4 unusable, 2 unreadable.
    """
    from .core.notices import EXIT_CODES
    from .inspect.inspect import inspect as inspected
    from .inspect.inspect import inspect_image, inspect_video, is_image
    from .plugins.options import pairs
    from .reading.load import adapters

    is_video = adapter == "auto" and adapters()["video"].sniff(file)
    if is_video or (adapter == "auto" and is_image(file)):
        of_poses = {"--person": person, "-O": option}
        if unread := [flag for flag, value in of_poses.items() if value]:
            what = "a video" if is_video else "an image"
            raise InputError(
                "option-conflict",
                f"{', '.join(unread)} is for a file of poses or keypoints, and {file} is {what}; leave it out.",
            )
        camera = inspect_video(file) if is_video else inspect_image(file)
        print(json.dumps(camera.figures(), indent=1) if as_json else camera)
        return
    inspection = inspected(file, adapter, pairs(option), person)
    print(json.dumps(inspection.figures(), indent=1) if as_json else inspection)
    raise typer.Exit(EXIT_CODES[inspection.verdict])


def list_(
    what: Annotated[
        Literal["adapters", "stages", "models", "writers", "devices", "figures", "notices", "refusals"],
        typer.Argument(help="What to list."),
    ],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON, for programs.")] = False,
) -> None:
    """List what is installed, or all that a run can measure (figures), say (notices) or refuse (refusals), one line
    each."""
    from .core import device, errors, figures, notices

    catalogues = {"devices": device, "figures": figures, "notices": notices, "refusals": errors}
    rows = catalogues[what].listed() if what in catalogues else registry.listed(what)
    if as_json:
        print(json.dumps(rows, indent=1))
        return
    wide = [max(map(len, column)) for column in zip(*(row.values() for row in rows), strict=True)]
    for row in rows:
        first, second, third = row.values()
        print(f"{first:<{wide[0]}}  {second:<{wide[1]}}  {' '.join(third.split())}".rstrip())


def main() -> None:
    """Entry point; exit codes of design.md section 7."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a name that the terminal cannot show must not end a run
            stream.reconfigure(errors="backslashreplace")
    limit_opencv()
    ended_by: list[int] = []

    def end(number: int, frame: object) -> None:
        ended_by.append(number)
        sys.exit(128 + number)  # so that half-made files go

    signal.signal(signal.SIGTERM, end)
    try:
        app(standalone_mode=True)
    except KeyboardInterrupt:
        _fail("interrupted", 130)
    except Exception as error:
        if ended_by:  # a package whose import was cut short makes an error of its own of the exit
            sys.exit(128 + ended_by[0])
        _explain(error)


def program() -> None:
    """`pcnet3d` as a process of its own, which ends as soon as it has said its last word.

    While Python takes itself down, threads of Arrow that have just begun abort it now and then, whatever its exit code
    was (apache/arrow issue 34314).
    """
    code: str | int | None = 0
    try:
        main()
    except SystemExit as ended:
        code = ended.code
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):  # what it said did not arrive: a full disk, or a reader that has gone
            code = code or 1
    os._exit(code if isinstance(code, int) else bool(code))


def _explain(error: Exception) -> None:
    """What went wrong, and the exit code that says whose fault it is."""
    if isinstance(error, InputError):
        if is_verbose():
            traceback.print_exc()
        _fail(str(error), 2)
    if isinstance(error, OSError):
        _fail(f"{error.filename or 'A file'} could not be read or written: {error.strerror or error}.", 2)
    traceback.print_exc()
    others = sorted(registry.packages().keys() - {"pcnet3d"})
    or_of = f", or of a package that adds to it ({', '.join(others)})" if others else ""
    _fail(f"this is a fault of pcnet3d{or_of}, not of your input; please report it with the lines above.", 1)


def _fail(message: str, code: int) -> None:
    say("pcnet3d", message)
    sys.stderr.flush()
    os._exit(code) if code == 130 else sys.exit(code)
