"""The command line: run, view, inspect, list, and every command that a package registers."""

from __future__ import annotations

import io
import json
import os
import shlex
import signal
import sys
import traceback
from pathlib import Path
from typing import Annotated, Literal

import typer

from .errors import InputError
from .files.detections import interrupted_at
from .motion.swap_repair import Swaps
from .plugins import registry
from .plugins.options import pairs
from .reading.load import Missing, Parity, adapters
from .reading.take import Sources
from .running.plan import planned
from .running.progress import conclude, stages, tell, tell_people, telling_of_kept
from .running.run import checkpoint_of, run_files, run_people

app = typer.Typer(
    name="pcnet3d",
    help="Kinematics that mean the same thing from every camera.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


@app.command()
def run(
    output: Annotated[Path, typer.Option("-o", "--output", help="Folder for the results.")],
    video: Annotated[Path | None, typer.Argument(help="The recorded video.")] = None,
    poses: Annotated[Path | None, typer.Option(help="3D poses of a lifter: a file or a folder.")] = None,
    adapter: Annotated[str, typer.Option(help="Format of --poses; see `pcnet3d list adapters`.")] = "auto",
    keypoints: Annotated[Path | None, typer.Option(help="2D keypoints: a file or a folder.")] = None,
    keypoints_adapter: Annotated[str, typer.Option(help="Format of --keypoints.")] = "auto",
    person: Annotated[
        str | None,
        typer.Option(
            help="Which person, by the file's name; or 'longest', 'largest', 'all' (a folder each)."
        ),
    ] = None,
    fps: Annotated[float | None, typer.Option(help="Frame rate, when there is no video to ask.")] = None,
    first_frame: Annotated[int | None, typer.Option(help="Video frame of the first row.")] = None,
    stature: Annotated[
        float | None, typer.Option(help="The person's height in metres; sets the scale.")
    ] = None,
    detector: Annotated[
        str | None,
        typer.Option(
            help="Network that finds joints in the video: a name of `pcnet3d list models`, or a file."
        ),
    ] = None,
    person_detector: Annotated[
        str | None, typer.Option(help="Network that finds people for the detector, by name or file.")
    ] = None,
    smooth: Annotated[
        float | None, typer.Option(help="Low-pass of detected keypoints in Hz; none without it.")
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the detection that was interrupted in this folder.")
    ] = False,
    lifter: Annotated[
        str | None, typer.Option(help="pcnet3d, the built-in one, or an .onnx file; without --poses.")
    ] = None,
    lifter_kind: Annotated[
        str | None, typer.Option(help="What --lifter is, such as motionbert, where the file does not say.")
    ] = None,
    image_size: Annotated[
        str | None, typer.Option(help="WIDTHxHEIGHT in pixels, to lift keypoints without a video.")
    ] = None,
    focal: Annotated[float | None, typer.Option(help="Focal length in pixels, if known.")] = None,
    flip: Annotated[
        bool, typer.Option("--flip", help="Average the lift with that of the mirrored person.")
    ] = False,
    rectifier: Annotated[
        str | None, typer.Option(help="geometric, pcnet, paper, or a trained .onnx file.")
    ] = None,
    camera: Annotated[
        str | None, typer.Option(help="static, one that stands still (the default), or moving.")
    ] = None,
    gravity: Annotated[
        str | None,
        typer.Option(help="X,Y,Z: which way things fall, in the camera's axes (x right, y down, z away)."),
    ] = None,
    pitch: Annotated[
        float | None,
        typer.Option(help="By how many degrees the camera looks down, if known; no roll then counts as 0."),
    ] = None,
    roll: Annotated[
        float | None,
        typer.Option(help="By how many degrees the picture's content is turned counter-clockwise, if known."),
    ] = None,
    camera_file: Annotated[
        Path | None,
        typer.Option(help="A camera's calibration: OpenCV, ROS, COLMAP, Pose2Sim, Caliscope or Qualisys."),
    ] = None,
    camera_name: Annotated[str | None, typer.Option(help="Which camera of --camera-file.")] = None,
    gravity_network: Annotated[
        str | None,
        typer.Option(
            help="Network to ask where the image's lines do not tell up: geocalib, or an .onnx file."
        ),
    ] = None,
    no_calibrate: Annotated[
        bool,
        typer.Option("--no-calibrate", help="Do not look for up and focal length in the video's images."),
    ] = False,
    parity: Annotated[Parity, typer.Option(help="What to do when left and right look exchanged.")] = "refuse",
    missing: Annotated[Missing, typer.Option(help="What to do with NaN or all-zero poses.")] = "refuse",
    swaps: Annotated[
        Swaps,
        typer.Option(help="What to do when limbs are exchanged, or mirrored in depth, for some frames."),
    ] = "report",
    option: Annotated[
        list[str] | None, typer.Option("--option", "-O", help="KEY=VALUE for the poses' adapter; repeatable.")
    ] = None,
    keypoints_option: Annotated[
        list[str] | None, typer.Option(help="KEY=VALUE for the keypoints' adapter.")
    ] = None,
    cutoff: Annotated[
        str | None,
        typer.Option(
            help="Low-pass cut-off of paths in Hz (6 without it), or auto to have it chosen from the take."
        ),
    ] = None,
    also: Annotated[
        list[str] | None,
        typer.Option(
            help="Another file to write: a name of `pcnet3d list writers`, such as csv or c3d; repeatable."
        ),
    ] = None,
    recipe: Annotated[Path | None, typer.Option(help="Stages and their options, a TOML file.")] = None,
    no_frames: Annotated[bool, typer.Option("--no-frames", help="Keep pictures of the person out.")] = False,
    force: Annotated[bool, typer.Option("--force", help="Replace a folder that is not ours.")] = False,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict",
            help="End with exit code 3 when the poses are suspicious, 4 when not usable or not levelled.",
        ),
    ] = False,
) -> None:
    """Turn a recorded video's keypoints and a lifter's poses into a rectified recording.

    Without --poses the keypoints are lifted, by our own network or by --lifter; without --keypoints too, they are first
    detected in the video.
    """
    chosen = planned(locals())
    sources = Sources(
        poses=poses,
        video=video,
        keypoints=keypoints,
        adapter=adapter,
        keypoints_adapter=keypoints_adapter,
        person=person,
        fps=fps,
        first_frame=first_frame,
        parity=parity,
        missing=missing,
        swaps=swaps,
        options=pairs(option),
        keypoints_options=pairs(keypoints_option),
    )
    names = ["read", *(entry.use for entry in chosen.stages)]
    kept = checkpoint_of(output) if "detect" in names else None
    with telling_of_kept(kept, resume), stages(names) as done:
        if person == "all":
            people = run_people(sources, output, chosen, force=force, done=done)
        else:
            take = run_files(sources, output, chosen, force=force, done=done)
    shown = output
    if person == "all":
        tell_people(people)
        shown = output / next(run.folder for run in people if run.folder)
    else:
        tell(take)
    print(f"{output}: {', '.join(sorted(path.name for path in output.iterdir()))}")
    print(f"look at it with: pcnet3d view {shlex.quote(str(shown))}")
    takes = (
        {f"person {run.person}: ": run.take for run in people if run.take} if person == "all" else {"": take}
    )
    code = conclude(takes, strict)
    if person != "all" and interrupted_at(take) is not None:
        raise typer.Exit(130)
    if code:
        raise typer.Exit(code)


@app.command()
def view(
    folder: Annotated[Path, typer.Argument(help="A run's folder.")],
    web: Annotated[bool, typer.Option("--web", help="Serve it to a browser on this machine.")] = False,
) -> None:
    """Open a run's recording."""
    from .files.viewer import view as open_recording

    open_recording(folder, web)


@app.command()
def inspect(
    file: Annotated[Path, typer.Argument(help="3D poses, 2D keypoints (a file or a folder), or a video.")],
    adapter: Annotated[str, typer.Option(help="Its format; see `pcnet3d list adapters`.")] = "auto",
    person: Annotated[
        str | None, typer.Option(help="Only this person, by the file's name, or 'longest' or 'largest'.")
    ] = None,
    keypoints: Annotated[Path | None, typer.Option(help="2D keypoints that the poses should fit.")] = None,
    video: Annotated[Path | None, typer.Option(help="The recording that the poses should fit.")] = None,
    option: Annotated[
        list[str] | None, typer.Option("--option", "-O", help="KEY=VALUE for the file's adapter; repeatable.")
    ] = None,
    plot: Annotated[Path | None, typer.Option(help="PNG to write: four frames from three sides.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="For programs.")] = False,
) -> None:
    """Say what a file holds and what is wrong with it; exit code 0 good, 3 suspicious, 4 unusable, 2 unreadable."""
    from .inspect.inspect import EXIT_CODES
    from .inspect.inspect import inspect as inspected

    if adapter == "auto" and adapters()["video"].sniff(file):
        from .inspect.video import inspect_video

        seen = inspect_video(file)
        print(json.dumps(seen.figures(), indent=1) if as_json else seen)
        return
    found = inspected(file, adapter, pairs(option), person=person, keypoints=keypoints, video=video)
    print(json.dumps(found.figures(), indent=1) if as_json else found)
    if plot is not None:
        from .inspect.picture import draw

        drawn = max(found.people, key=lambda one: (one.poses is not None, len(one.source))).poses
        if drawn is None:
            raise InputError(f"{file} has no 3D poses that could be drawn; leave --plot out.")
        draw(drawn, plot)
    raise typer.Exit(EXIT_CODES[found.verdict])


@app.command(name="list")
def list_(
    what: Annotated[Literal["adapters", "stages", "models", "writers"], typer.Argument(help="What to list.")],
    as_json: Annotated[bool, typer.Option("--json", help="For programs.")] = False,
) -> None:
    """List what is installed, one line each."""
    rows = registry.listed(what)
    if as_json:
        print(json.dumps(rows, indent=1))
        return
    wide = [max(map(len, column)) for column in zip(*(row.values() for row in rows), strict=True)]
    for row in rows:
        first, second, third = row.values()
        print(f"{first:<{wide[0]}}  {second:<{wide[1]}}  {' '.join(third.split())}".rstrip())


def _add_commands(asked: set[str]) -> None:
    """The commands that are asked for, or all for the help page. Importing them all takes its time, and a package
    whose command cannot be loaded must not keep the others from working."""
    known = registry.registered("commands")
    for name in asked.intersection(known) or known:
        try:
            command = registry.load("commands", name)
            if isinstance(command, typer.Typer):
                app.add_typer(command, name=name)
            else:
                app.command(name=name)(command)
        except InputError as error:
            print(f"warning: {error}", file=sys.stderr)


def main() -> None:
    """Entry point; exit codes of design.md section 7."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # a name that the terminal cannot show must not end a run
            stream.reconfigure(errors="backslashreplace")
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))  # so that half-made files go
    try:
        _add_commands(set(sys.argv[1:2]))
        app(standalone_mode=True)
    except InputError as error:
        _fail(str(error), 2)
    except KeyboardInterrupt:
        _fail("interrupted", 130)
    except OSError as error:
        _fail(f"{error.filename or 'A file'} could not be read or written: {error.strerror or error}.", 2)
    except Exception:
        traceback.print_exc()
        _fail("this is a fault of pcnet3d, not of your input; please report it with the lines above.", 1)


def _fail(message: str, code: int) -> None:
    print(f"pcnet3d: {message}", file=sys.stderr)
    sys.stderr.flush()
    os._exit(code) if code == 130 else sys.exit(code)
