"""A whole run from Python: files, arrays or functions in; a take out, or a folder of results."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

from ..core.errors import InputError
from ..core.layouts import Layout, layout_named
from ..core.take import Take
from ..reading.given import Meaning, source_of
from ..reading.settings import RunOptions
from .plan import planned
from .recipe import Recipe
from .run import run_files, run_in_memory


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
