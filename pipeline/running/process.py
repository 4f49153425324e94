"""A whole run from Python: files, arrays or functions in, the take out (`process`), or a folder of results (`run`)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..core.errors import InputError
from ..core.layouts import Layout
from ..core.take import Take
from ..reading.given import Meaning, source_of_keypoints, source_of_poses
from ..reading.settings import RunOptions
from ..reading.take import Given
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
    **options: Any,
) -> Take:
    """The whole chain in memory; nothing is written.

    video: a path. keypoints: a path, an array (T, K, 2) or, with scores, (T, K, 3), in pixels of the image, or what
        `read` gives. poses: a path, an array (T, J, 3), or what `read` gives. A row of an array is a frame.
    detect: a name of `pcnet3d list models`, an .onnx file, or a function: an RGB image (H, W, 3) uint8 -> keypoints
        with scores of everybody (people, K, 3).
    lift: such a name or file, or a function: keypoints (T, K, 3), size (width, height), fps -> poses (T, 17, 3) of
        Human3.6M's joints in CAMERA axes (x right, y down, z away).
    axes, joints, unit: of an array of poses, as of `rectify`; unit also of what a function lifts.
    keypoint_joints: the layout of keypoints in an array or by a function, if it is not the usual one of K joints.
    recipe: other stages. options: of `pcnet3d run`, by the names of `RunOptions`, such as fps, stature, camera,
        image_size and settings; check="off" takes poses as they are.

    Raises InputError as a run does, and where a function raises or answers another shape or number of frames, with its
    name and the frame.
    """
    asked = _Inputs(
        video,
        keypoints,
        poses,
        {"detect": detect, "lift": lift},
        Meaning(axes, joints, unit),
        keypoint_joints,
        recipe,
    )
    run_options, chosen, given = asked.prepared(options)
    if run_options.also:
        raise InputError(
            "option-conflict", "process writes no files: leave also out, or use run(output, also=...)."
        )
    return run_in_memory(run_options, chosen, given)


def run(
    output: str | Path,
    *,
    force: bool = False,
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
    **options: Any,
) -> Take:
    """As `process`, and writes what `pcnet3d run` writes into the folder `output`: all of it or nothing.

    force: overwrite a folder of somebody else's. All else is as for `process`. Raises InputError.
    """
    asked = _Inputs(
        video,
        keypoints,
        poses,
        {"detect": detect, "lift": lift},
        Meaning(axes, joints, unit),
        keypoint_joints,
        recipe,
    )
    run_options, chosen, given = asked.prepared(options)
    return run_files(run_options, output, chosen, force=force, given=given)


@dataclass(frozen=True, eq=False)
class _Inputs:
    """What `process` and `run` take beside the options of `RunOptions`. networks: `detect` and `lift`."""

    video: Any
    keypoints: Any
    poses: Any
    networks: dict[str, Any]
    meaning: Meaning
    keypoint_joints: Layout | str | None
    recipe: Recipe | str | Path | None

    def prepared(self, options: dict[str, Any]) -> tuple[RunOptions, Recipe, Given]:
        """Options that name what is in memory by a label, the recipe with the functions in it, and what is in memory.
        InputError for an input of another kind, and for what is said of none."""
        if not isinstance(self.video, str | Path | None):
            raise InputError(
                "bad-value",
                f"Expected video as the path of a file, got {type(self.video).__name__}; of images in memory give "
                "keypoints.",
            )
        named = {role: self._file(role) for role in _FOR_FILES} | {"video": self.video}
        named |= {
            _OPTION[role]: str(network)
            for role, network in self.networks.items()
            if network and not callable(network)
        }
        path, recipe = (None, self.recipe) if isinstance(self.recipe, Recipe) else (self.recipe, None)
        run_options = RunOptions(recipe=path, **named, **options)
        given = self._given(run_options)
        labels = {role: source.path for role, source in vars(given).items() if source is not None}
        run_options = run_options.with_(**labels)
        return run_options, self._with_functions(planned(run_options, recipe), given), given

    def _file(self, role: str) -> Any:
        value = getattr(self, role)
        return value if isinstance(value, str | Path) else None

    def _given(self, run_options: RunOptions) -> Given:
        poses = keypoints = None
        if self.poses is not None and self._file("poses") is None:
            poses = source_of_poses(self.poses, self.meaning, run_options.guards)
        if self.keypoints is not None and self._file("keypoints") is None:
            keypoints = source_of_keypoints(self.keypoints, self.keypoint_joints)
        given = Given(poses, keypoints)
        for role, flags in _FOR_FILES.items():
            unread = [flag for flag in flags if getattr(run_options, flag) not in ("auto", {})]
            if unread and getattr(given, role) is not None:
                raise InputError(
                    "option-conflict",
                    f"{', '.join(unread)} is for a file of {role}, got them in memory; leave it out.",
                )
        return given

    def _with_functions(self, recipe: Recipe, given: Given) -> Recipe:
        functions = {role: network for role, network in self.networks.items() if callable(network)}
        for role, function in functions.items():
            if not recipe.has(role):
                others = "keypoints and poses" if role == "detect" else "poses"
                raise InputError("option-conflict", f"{role} is for a run without {others}; leave it out.")
            recipe = recipe.with_options(role, **{_OPTION[role]: function})
        meaning = self.meaning
        if given.poses is not None:
            meaning = Meaning()
        elif "lift" in functions and meaning.unit is not None:
            recipe = recipe.with_options("lift", unit=meaning.unit)
            meaning = replace(meaning, unit=None)
        meaning.refuse()
        if (joints := self.keypoint_joints) is not None and given.keypoints is None:
            if "detect" not in functions:
                raise InputError(
                    "option-conflict",
                    "keypoint_joints is for keypoints in memory or by a function; of a file give "
                    'settings={"keypoints.layout": NAME}.',
                )
            recipe = recipe.with_options("detect", joints=joints if isinstance(joints, str) else joints.name)
        return recipe


_OPTION = {"detect": "detector", "lift": "lifter"}  # of the stages of these names
_FOR_FILES = {"poses": ("adapter", "options"), "keypoints": ("keypoints_adapter", "keypoints_options")}
