"""Runs stages over a take; a chain that cannot work is refused before the first of them works."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.system import give_memory_back
from ..core.take import Take
from ..plugins.protocols import Stage
from ..reading.findings import looked_at
from ..signals.filters import rate


@dataclass(frozen=True)
class Pipeline:
    """An ordered chain of stages."""

    stages: tuple[Stage, ...]

    def check(self, take: Take) -> None:
        """Raise InputError when a stage needs something that neither the take nor an earlier stage gives, changes
        something that an earlier stage has already used, or cannot work with the unit of the poses or the rate of the
        frames."""
        unit, fps = take.poses.frame.unit if take.poses is not None else "", _frame_rate(take)
        filled = {field.name for field in fields(Take) if getattr(take, field.name) is not None}
        for position, stage in enumerate(self.stages):
            for earlier in self.stages[:position]:
                for name in set(earlier.needs).intersection(stage.gives):
                    if not set(earlier.gives) <= {name, *getattr(stage, "renews", ())}:
                        raise InputError(
                            "needs-stage",
                            f"Stage '{stage.name}' would change {name} after '{earlier.name}' has used them; "
                            f"put it before '{earlier.name}'.",
                        )
            for name in stage.needs:
                if name not in filled:
                    raise InputError(
                        "needs-stage",
                        f"Stage '{stage.name}' needs {name}, which neither the input nor an earlier stage gives; "
                        f"the order is {' > '.join(s.name for s in self.stages)}.",
                    )
            filled.update(stage.gives)
            _asked(stage, "check_told", take.told)
            _asked(stage, "check_unit", unit)
            _asked(stage, "check_rate", fps)
            if "poses" in stage.gives:
                unit = _asked(stage, "unit_of", unit, take.told) or ""

    def __call__(self, take: Take, done: Callable[[str, float], None] = lambda stage, seconds: None) -> Take:
        """The take after every stage; `done(stage name, seconds)` is called after each."""
        (end,) = run_together([self], [take], done)
        if isinstance(end, InputError):
            raise end
        return end


def run_together(
    pipelines: Sequence[Pipeline],
    takes: list[Take],
    done: Callable[[str, float], None] = lambda stage, seconds: None,
) -> list[Take | InputError]:
    """Takes of one person or several, each through a pipeline of its own; all pipelines have the same stages.

    All takes go through a stage before any goes on to the next, so that one with `together` gets them at once. A take
    that a stage refuses ends there, as that refusal; so does one whose poses, which nobody has looked at, are mirrored
    or upside down (`looked_at`). `done(stage name, seconds)` is called after each that somebody
    came through; the memory that stages used is given back. The list `takes` is emptied: what a stage replaces is not
    to be held beside its answer. InputError for a chain that cannot work.
    """
    for i, pipeline in enumerate(pipelines):
        pipeline.check(takes[i])
    results: list[Take | InputError] = [_tried(looked_at, take) for take in takes]
    takes.clear()
    for stages in zip(*(pipeline.stages for pipeline in pipelines), strict=True):
        start = time.perf_counter()
        going = {i: take for i, take in enumerate(results) if isinstance(take, Take)}
        if not going:
            break
        ends = _asked(stages[0], "together", list(going.values())) if len(going) > 1 else None
        if ends is None:
            ends = [_tried(partial(_run, stages[i]), take) for i, take in going.items()]
        ended = dict(zip(going, ends, strict=True))
        results = [ended.get(i, result) for i, result in enumerate(results)]
        if any(isinstance(end, Take) for end in ended.values()):
            done(stages[0].name, time.perf_counter() - start)
        going.clear()
        give_memory_back()
    return results


def _frame_rate(take: Take) -> float:
    """Video frames a second, as stages will have them; NaN where that is not known, and where there is one only."""
    if (rows := take.rows) is not None:
        if rows.time_s is None or len(rows) < 2:
            return float("nan")
        return rate(rows.times) * float(np.median(np.diff(rows.frame_index)))
    if take.told.fps is not None or take.video is None:
        return take.told.fps or float("nan")
    first, last = take.video.span
    return rate(take.video.time_s[first : last + 1])


def _asked(stage: Stage, method: str, *arguments: Any) -> Any:
    """The answer of a method that a stage may have; None of one that has not."""
    asked = getattr(stage, method, None)
    return None if asked is None else asked(*arguments)


def _tried(step: Callable[[Take], Take], take: Take) -> Take | InputError:
    try:
        return step(take)
    except InputError as error:
        return error


def _run(stage: Stage, take: Take) -> Take:
    """What a stage returns; InputError where that is no take, or one with a column that has not a value a frame."""
    made: object = stage(take)
    if not isinstance(made, Take):
        raise _broken(stage, "a take", f"{type(made).__name__}; a stage returns the take that it made")
    rows = len(made.poses) if made.poses else 0
    for name, values in (made.kinematics or {}).items():
        if (shape := np.shape(values)) != (rows,):
            got = f"the shape {shape}; a column has a value a frame, here {rows}"
            raise _broken(stage, f"a column '{name}'", got)
    return made


def _broken(stage: Stage, expected: str, got: str) -> InputError:
    return InputError(
        "plugin-broken",
        f"Expected {expected} from stage '{stage.name}', got {got} (docs/python.md): repair its package, or leave the "
        "stage out.",
    )
