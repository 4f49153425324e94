"""Runs stages over a take; a chain that cannot work is refused before any data is touched."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, fields

from .errors import InputError
from .sockets import Stage
from .take import Take


@dataclass(frozen=True)
class Pipeline:
    """An ordered chain of stages."""

    stages: tuple[Stage, ...]

    def check(self, take: Take) -> None:
        """Raise InputError when a stage needs something that neither the take nor a stage before it gives, or changes
        something that an earlier stage has drawn conclusions from."""
        known = {field.name for field in fields(Take)}
        filled = {name for name in known if getattr(take, name) is not None}
        for position, stage in enumerate(self.stages):
            for earlier in self.stages[:position]:
                for name in set(earlier.needs).intersection(stage.gives):
                    if set(earlier.gives) != {name}:
                        raise InputError(
                            f"Stage '{stage.name}' would change {name} after '{earlier.name}' has used them; "
                            f"put it before '{earlier.name}'."
                        )
            for name in stage.needs:
                if name not in known:
                    raise InputError(f"Stage '{stage.name}' needs '{name}', which no take has.")
                if name not in filled:
                    raise InputError(
                        f"Stage '{stage.name}' needs {name}, which neither the input nor an earlier stage gives; "
                        f"the order is {' > '.join(s.name for s in self.stages)}."
                    )
            filled.update(stage.gives)

    def __call__(self, take: Take, done: Callable[[str, float], None] = lambda stage, seconds: None) -> Take:
        """The take after every stage; `done(stage name, seconds)` is called after each."""
        self.check(take)
        for stage in self.stages:
            start = time.perf_counter()
            take = stage(take)
            done(stage.name, time.perf_counter() - start)
        return take
