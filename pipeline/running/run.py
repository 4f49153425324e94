"""One run: files in, a folder of results out; from Python also arrays or functions in, and a take out."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal

from ..core.device import Placement, computing_on
from ..core.errors import InputError
from ..core.layouts import Layout, layout_named
from ..core.pose import package_version
from ..core.system import give_memory_back, is_file_name
from ..core.take import Take
from ..files.atomic import SUMMARY, add_to_summary, require_space, sign, whole_folder, write_json
from ..files.names import KEYPOINTS
from ..plugins.options import files_among
from ..reading.given import Meaning, source_of
from ..reading.settings import RunOptions, flag_of
from ..reading.take import Person, open_people, open_take
from .recipe import Recipe, planned
from .runner import run_together

WRITERS = ("record", "export", "report")  # stages that do nothing else
_AIMED = ("detect", *WRITERS)  # stages that are told where the run's folder is
_LEFT = ("resume", "checkpoint")  # options that name what the run itself leaves in its folder
_LONGEST = 60  # characters of a folder's name

Done = Callable[[str, float], None]  # called with "read" and then each stage's name, and its seconds


def checkpoint_of(output: Path) -> Path:
    """Where a run into that folder keeps what it has detected until it is complete; the file stays when the run fails
    or is killed."""
    output = output.resolve()  # "/" has no name, and `whole_folder` refuses it
    return output.parent / f".{output.name}.{KEYPOINTS}"


def _silent(stage: str, seconds: float) -> None:
    pass


def run_files(
    options: RunOptions,
    output: str | Path,
    recipe: Recipe | None = None,
    *,
    resume: bool = False,
    force: bool = False,
    done: Done = _silent,
) -> Take:
    """`run_people` of one person alone: the take."""
    one = options.with_(everyone=False)
    (run,) = run_people(one, output, recipe, resume=resume, force=force, done=done)
    assert run.take is not None
    return run.take


def run_people(
    options: RunOptions,
    output: str | Path,
    recipe: Recipe | None = None,
    *,
    resume: bool = False,
    force: bool = False,
    done: Done = _silent,
) -> tuple[Person, ...]:
    """Read the files that the options name, run the recipe, and write its files into `output`: all of them or none.

    With `everyone` everybody in the files has a folder in `output`, all one common LEVEL. People of different scenes of
    a video, which a cut parts, share no LEVEL and no camera: each scene has its own. `output` gets a summary.json that
    lists the people, in the order of the answer. Who is seen too briefly, or refused by a stage, is left out with the
    reason.

    recipe: instead of the default one; the options apply to it (`planned`). resume: go on with the detection that was
    interrupted in that folder. force: overwrite a folder of somebody else's. Raises InputError, with `everyone` when
    nobody is left.
    """
    output, everybody = Path(output), options.everyone
    for name in ("stature", "person", "person_id") if everybody else ():
        if getattr(options, name) is not None:
            raise InputError(
                "option-conflict",
                f"{flag_of(name)} is for one person, and the run is for everybody: leave it out, or run one --person "
                "at a time.",
            )
    recipe, kept = _kept(planned(options, recipe), output, resume, everybody), checkpoint_of(output)
    inputs = inputs_of(options, recipe)
    with whole_folder(output, force, inputs) as folder, computing_on(options.device) as placement:
        if recipe.has("record"):
            _require_space_of_video(folder, options)
        if everybody and recipe.has("detect"):
            options, recipe = _detected(folder, options, recipe, done), recipe.without("detect")
        _aimed(recipe, folder).build()  # refused before anything is read
        start = time.perf_counter()
        people = [*open_people(options)] if everybody else [Person("", 0, open_take(options))]
        done("read", time.perf_counter() - start)
        give_memory_back()
        runs = _processed(people, folder, recipe, placement, done, everybody)
    kept.unlink(missing_ok=True)
    return runs


def _require_space_of_video(folder: Path, options: RunOptions) -> None:
    """The recording holds the whole video: InputError before the detection and not after it, where the disk is full."""
    whole = not options.no_frames and options.time_range is None
    if whole and options.video is not None and options.video.is_file():
        require_space(folder, options.video.stat().st_size, "The recording")


def _detected(folder: Path, options: RunOptions, recipe: Recipe, done: Done) -> RunOptions:
    """The options of a run of everybody whom the recipe's stage `detect` finds in the video, with the file of keypoints
    that it writes into the folder."""
    take = recipe.only("detect").with_options("detect", folder=folder).build()(open_take(options), done)
    if any(each.code == "interrupted" for each in take.notices):
        raise KeyboardInterrupt
    return options.with_(keypoints=folder / KEYPOINTS)


def _processed(
    people: list[Person], folder: Path, recipe: Recipe, placement: Placement, done: Done, everybody: bool
) -> tuple[Person, ...]:
    """The runs of people, those of one scene of the video together. The list is emptied: what stages replace is not to
    be held beside their answers. With everybody each has a folder in `folder`."""
    takes = {i: person.take for i, person in enumerate(people) if person.take is not None}
    ended = [replace(person, take=None) for person in people]
    people.clear()
    names = folder_names([ended[i].name for i in takes]) if everybody else [""]
    folders = dict(zip(takes, names, strict=True))
    pipelines = {i: _aimed(recipe, folder / name).build() for i, name in folders.items()}
    scenes: dict[int, list[int]] = {}
    for i in takes:
        keypoints = takes[i].keypoints
        scenes.setdefault(keypoints.scene if keypoints else 0, []).append(i)
    for scene in scenes.values():
        ends = run_together([pipelines[i] for i in scene], [takes.pop(i) for i in scene], done)
        for i, end in zip(scene, ends, strict=True):
            own = folder / folders[i]
            if isinstance(end, Take):
                own.mkdir(exist_ok=True)
                add_to_summary(own, device=placement.summary())
                ended[i] = replace(ended[i], take=end, folder=folders[i])
            elif everybody:
                shutil.rmtree(own, ignore_errors=True)
                ended[i] = replace(ended[i], refusal=end)
            else:
                raise end
    if everybody:
        _list(ended, folder)
    return tuple(ended)


def _list(runs: Sequence[Person], folder: Path) -> None:
    """summary.json over the people's folders, each of which is a run of its own: who is in which, and who was left out
    and why. InputError where there are none."""
    people, left_out = [], []
    for run in runs:
        whose = {"person": run.name, "frames": run.frames}
        if run.refusal is not None:
            left_out.append({**whose, "code": run.refusal.code, "reason": str(run.refusal)})
            continue
        assert run.take is not None
        assert run.take.rows is not None  # for `open_people` refuses who is hardly seen
        sign(folder / run.folder)
        first, last = run.take.rows.frame_index[[0, -1]].tolist()
        level = run.take.rectified
        whose |= {"folder": run.folder, "first_frame": first, "last_frame": last}
        whose |= {"level_ok": level is not None and level.level_ok}
        people.append({**whose, "warnings": sum(each.warns for each in run.take.said)})
    if not people:
        reasons = "; ".join(f"{each['person']}: {each['reason'].rstrip('.')}" for each in left_out)
        raise InputError("nothing-usable", f"There is no person to process: {reasons}.")
    content = {"pcnet3d": package_version(), "people": people, "left_out": left_out}
    write_json(folder / SUMMARY, content)


def folder_names(people: Sequence[str]) -> list[str]:
    """A name for each person's folder that every file system takes, different from all others in any case."""
    names: list[str] = []
    for person in people:
        safe = re.sub(r"[^A-Za-z0-9_-]+", "_", person)[:_LONGEST] or "_"
        safe = safe if is_file_name(safe) else f"{safe}_"
        name, number = safe, 2
        while name.lower() in (taken.lower() for taken in names):
            name, number = f"{safe}_{number}", number + 1
        names.append(name)
    return names


def run_in_memory(options: RunOptions, recipe: Recipe) -> Take:
    """The take of what the options name, through the recipe's stages, of which those that write files are left out.
    Raises InputError."""
    for stage in WRITERS:
        recipe = recipe.without(stage)
    with computing_on(options.device):
        pipeline = recipe.build()  # refused before anything is read
        return pipeline(open_take(options))


def inputs_of(options: RunOptions, recipe: Recipe) -> list[Path]:
    """The files that a run is given, which it must not replace: its own, and those that options of readers and stages
    name, such as networks and cameras."""
    files = (options.poses, options.keypoints, options.video, options.recipe)
    options_of_all = (options.options, options.keypoints_options, *(entry.options for entry in recipe.stages))
    named = [path for each in options_of_all for name, path in files_among(each).items() if name not in _LEFT]
    return [path for path in files if path and path.exists()] + named


def _kept(recipe: Recipe, output: Path, resume: bool, everybody: bool) -> Recipe:
    """The recipe whose detection is kept beside the run's folder; with `resume` it goes on from what an interrupted run
    left there or in the folder. InputError where nothing is left, and for a recipe that says itself where files go."""
    for entry in recipe.stages:
        if entry.use in _AIMED and entry.options.keys() & {"folder", "checkpoint", "everybody"}:
            raise InputError(
                "option-conflict",
                f"Stage '{entry.use}': the folder is the run's own (-o DIR), not the recipe's.",
            )
    kept = checkpoint_of(output)
    recipe = recipe.with_options("detect", checkpoint=kept, everybody=everybody)
    if not resume:
        return recipe
    left = next(filter(Path.is_file, (kept, output / KEYPOINTS)), None)
    if left is None or not recipe.has("detect"):
        raise InputError(
            "option-conflict",
            f"There is no interrupted run in {output} whose detection this one could continue; leave --resume out.",
        )
    return recipe.with_options("detect", resume=left)


def _aimed(recipe: Recipe, folder: Path) -> Recipe:
    for stage in _AIMED:
        recipe = recipe.with_options(stage, folder=folder)
    return recipe


def process(
    *,
    video: str | Path | None = None,
    keypoints: Any = None,
    poses: Any = None,
    detect: str | Path | Callable[..., Any] | None = None,
    lift: str | Path | Callable[..., Any] | None = None,
    axes: str | None = None,
    joints: Layout | str | None = None,
    unit: str | None = None,
    keypoint_joints: Layout | str | None = None,
    recipe: Recipe | str | Path | None = None,
    output: str | Path | None = None,
    force: bool = False,
    **options: Any,
) -> Take:
    """The whole chain in memory; with `output` it also writes what `pcnet3d run` writes.

    video: a path. keypoints: a path, an array (T, K, 2) or, with scores, (T, K, 3), in pixels of the image, or what
        `read` gives. poses: a path, an array (T, J, 3), or what `read` gives. A row of an array is a frame.
    detect: a name of `pcnet3d list models`, an .onnx file, or a function: an RGB image (H, W, 3) uint8 -> keypoints
        with scores of everybody (people, K, 3).
    lift: such a name or file, or a function: keypoints (T, K, 3), size (width, height), fps -> poses (T, 17, 3) of
        Human3.6M's joints in CAMERA axes (x right, y down, z away).
    axes, joints, unit: of an array of poses, as of `rectify`; unit also of what a function lifts.
    keypoint_joints: the layout of keypoints in an array or by a function, if it is not the usual one of K joints.
    recipe: other stages. output: the folder for the results, all of them or none. force: overwrite one of somebody
        else's. options: of `pcnet3d run`, by the names of `RunOptions`, such as fps, stature, camera, image_size and
        settings; check="off" takes poses as they are.

    Raises InputError as a run does, and where a function raises or answers another shape or number of frames, with its
    name and the frame.
    """
    if not isinstance(video, str | Path | None):
        raise InputError(
            "bad-value",
            f"Expected video as the path of a file, got {type(video).__name__}; of images in memory give keypoints.",
        )
    given: dict[Literal["poses", "keypoints"], Any] = {"poses": poses, "keypoints": keypoints}
    files = {role: each for role, each in given.items() if isinstance(each, str | Path)}
    held: dict[Literal["poses", "keypoints"], Any] = {
        role: each for role, each in given.items() if each is not None and role not in files
    }
    meanings = {"poses": Meaning(axes, joints, unit), "keypoints": Meaning(joints=keypoint_joints)}
    of_stages: dict[str, Any] = {"detect.detector": detect, "lift.lifter": lift}
    if "poses" not in held:
        Meaning(axes, joints, None if callable(lift) and "poses" not in files else unit).refuse()
        of_stages["lift.unit"] = unit
    if "keypoints" not in held and keypoint_joints is not None:
        if not callable(detect) or "keypoints" in files:
            raise InputError(
                "option-conflict",
                "keypoint_joints is for keypoints in memory or by a function; of a file give "
                'settings={"keypoints.layout": NAME}.',
            )
        of_stages["detect.joints"] = layout_named(keypoint_joints).name
    path, recipe = (None, recipe) if isinstance(recipe, Recipe) else (recipe, None)
    run_options = RunOptions(video=video, recipe=path, **files, **options)
    settings = {
        name: str(each) if isinstance(each, Path) else each for name, each in of_stages.items() if each
    }
    in_memory = {role: source_of(role, each, meanings[role], run_options.told) for role, each in held.items()}
    run_options = run_options.with_(
        settings={**run_options.settings, **settings},
        in_memory=in_memory,
        **{role: source.path for role, source in in_memory.items()},
    )
    if output is not None:
        return run_files(run_options, output, recipe, force=force)
    if run_options.also:
        raise InputError(
            "option-conflict", "Without output no files are written: give it, or leave also out."
        )
    return run_in_memory(run_options, planned(run_options, recipe))
