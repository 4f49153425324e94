"""Through which files a run of one X3D.npy goes before its first stage: `python tests/bench/count_stays.py`.

Whoever follows the code from the command line is in one file until it calls another, and comes back when that one is
done and its caller goes on. Counted are the files of pipeline/ and adapters/, without what is looked up and not
followed: pipeline/files, the flat core (pose, frames and so on) and what adapters do to recognise a file. The library
pipeline/signals counts as one file, and a loop counts once. Prints the stays, one a line, and marks those that lead
back
up.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

import pcnet3d.pipeline
from pcnet3d.examples.walker.walk import walker
from pcnet3d.pipeline.cli import app
from pcnet3d.pipeline.running.runner import Pipeline

PACKAGE = Path(pcnet3d.pipeline.__file__).parents[1]
FOLLOWED = ("pipeline/cli.py", "pipeline/plugins/", "pipeline/reading/", "pipeline/running/", "adapters/")
LIBRARY = "pipeline/signals/"


class _FirstError(Exception):
    """The first stage is reached."""


def place_of(frame: FrameType) -> str | None:
    """The file that a function is in, relative to the package; None when it is not followed."""
    path = Path(frame.f_code.co_filename)
    if frame.f_code.co_name == "<module>" or not path.is_relative_to(PACKAGE):
        return None
    place = path.relative_to(PACKAGE).as_posix()
    return LIBRARY if place.startswith(LIBRARY) else place if place.startswith(FOLLOWED) else None


def above(frame: FrameType) -> Iterator[FrameType]:
    """The callers of a function, the nearest first."""
    while (caller := frame.f_back) is not None:
        yield caller
        frame = caller


def stays_of(arguments: list[str]) -> list[tuple[str, bool]]:
    """Each file in the order in which the command enters it, and whether it is entered by going back to it."""
    stays: list[tuple[str, bool]] = []

    def enter(place: str, back: bool) -> None:
        if not stays or stays[-1][0] != place:
            stays.append((place, back))
        for length in range(1, len(stays) // 2 + 1):
            if stays[-length:] == stays[-2 * length : -length]:  # a loop
                del stays[-length:]
                break

    def followed(frame: FrameType, event: str, _: Any) -> None:
        if event != "call":
            return
        if frame.f_code is Pipeline.__call__.__code__:
            raise _FirstError
        place, callers = place_of(frame), list(above(frame))
        if place is None or any(each.f_code.co_name == "sniff" for each in (frame, *callers)):
            return
        caller = next(filter(None, map(place_of, callers)), None)
        if caller is not None and stays:
            enter(caller, True)
        enter(place, False)

    sys.setprofile(followed)
    try:
        app(arguments, standalone_mode=False)
    except _FirstError:
        pass
    finally:
        sys.setprofile(None)
    return stays


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        poses = walker(fps=30).poses.joints
        np.save(Path(folder) / "X3D.npy", poses - poses[:, :1] * [0, 0, 1])  # as MotionBERT, from depth 0
        arguments = ["run", "--poses", f"{folder}/X3D.npy", "--fps", "30", "-o", f"{folder}/out"]
        stays_of(arguments)  # imports, which are no part of it
        stays = stays_of(arguments)
    for place, back in stays:
        print(f"{'back to ' * back}{place}")
    names = {name for name, _ in stays}
    print(
        f"{len(stays)} stays in {len(names)} files, {sum(back for _, back in stays)} of them on the way back"
    )


if __name__ == "__main__":
    main()
