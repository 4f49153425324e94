"""What the options of `pcnet3d run` mean: which stages there are to be, and with which options of theirs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..files.detections import KEYPOINTS
from .recipe import Recipe, load_recipe
from .run import checkpoint_of


def planned(given: Mapping[str, Any]) -> Recipe:
    """The recipe of a run. given: options of `run` by the names of its parameters; None or absent where not given.

    Without poses the keypoints are lifted, without keypoints too they are first detected, and a video's images are
    asked about the camera. InputError for an option of a stage or a file that this run does not have, and for a value
    that cannot be read.
    """
    poses, keypoints, video = (given.get(role) for role in ("poses", "keypoints", "video"))
    chosen = load_recipe(given.get("recipe"))
    if poses is None:
        chosen = chosen.starting_with("lift")
    calibrated = video is not None and not given.get("no_calibrate")
    if calibrated:
        chosen = chosen.starting_with("calibrate")
    alone = poses is None and keypoints is None and video is not None
    if alone:
        chosen = chosen.starting_with("detect")
    readers = {"poses": ("adapter", "option"), "keypoints": ("keypoints_adapter", "keypoints_option")}
    for role, options in readers.items():
        unread = [name for name in options if given.get(name) not in (None, "auto")]
        if unread and given.get(role) is None:
            raise InputError(f"{', '.join(unread)} is for --{role} FILE, which this run does not have.")
    if alone and given.get("first_frame") is not None:
        raise InputError("--first-frame numbers the rows of a file, and there is none; leave it out.")

    person, camera, focal, parity = (given.get(name) for name in ("person", "camera", "focal", "parity"))
    gravity, image_size, also = (given.get(name) for name in ("gravity", "image_size", "also"))
    size = image_size and _size(image_size)
    changes = {
        "detect": {
            "detector": given.get("detector"),
            "person_detector": given.get("person_detector"),
            "smooth_hz": given.get("smooth"),
            "resume": _checkpoint(given["output"]) if given.get("resume") else None,
            "person": person if alone and person != "all" else None,
            "swaps": given.get("swaps") if alone else None,
            "fps": given.get("fps") if alone else None,
        },
        "calibrate": {
            "focal_px": focal if calibrated else None,
            "camera": camera if calibrated else None,
            "camera_file": given.get("camera_file"),
            "camera_name": given.get("camera_name"),
            "gravity_network": given.get("gravity_network"),
        },
        "lift": {
            "lifter": given.get("lifter"),
            "lifter_kind": given.get("lifter_kind"),
            "image_size": size,
            "focal_px": None if calibrated else focal,
            "flip": given.get("flip") or None,
            "parity": None if poses is not None or parity == "refuse" else parity,
        },
        "clean": {"image_size": size if any(entry.use == "clean" for entry in chosen.stages) else None},
        "scale": {"stature_m": given.get("stature")},
        "rectify": {
            "rectifier": given.get("rectifier"),
            "camera": camera,
            "gravity": gravity and _vector(gravity),
            "pitch_deg": given.get("pitch"),
            "roll_deg": given.get("roll"),
        },
        "trajectories": {"cutoff_hz": given.get("cutoff")},
        "export": {"also": tuple(also) if also else None},
    }
    for stage, options in changes.items():
        options = {key: value for key, value in options.items() if value is not None}
        if options and all(entry.use != stage for entry in chosen.stages):
            raise InputError(
                f"{', '.join(options)} is for the stage '{stage}', which this run does not have."
            )
        chosen = chosen.with_options(stage, **options)
    if given.get("no_frames"):
        chosen = chosen.with_options("record", frames=False).with_options("report", frames=False)
    return chosen


def _checkpoint(output: Path) -> Path:
    """What an interrupted run left, beside its folder or in it; InputError when there is nothing."""
    for path in (checkpoint_of(output), output / KEYPOINTS):
        if path.is_file():
            return path
    raise InputError(f"There is no interrupted run in {output} to go on with; leave --resume out.")


def _size(text: str) -> tuple[int, int]:
    width, times, height = text.lower().partition("x")
    if not (times and width.isdigit() and height.isdigit()):
        raise InputError(f"Expected --image-size WIDTHxHEIGHT such as 1920x1080, got '{text}'.")
    return int(width), int(height)


def _vector(text: str) -> tuple[float, float, float]:
    try:
        x, y, z = map(float, text.split(","))
    except ValueError:
        raise InputError(f"Expected --gravity X,Y,Z such as 0,1,0, got '{text}'.") from None
    return x, y, z
