"""Many damaged files of one reader, each read under guard."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from fuzz.guarded import Outcome, Worker, watched
from fuzz.readers import Seed, damage, read, seeds, write_seeds

SMALL_S = 1.0  # CPU seconds that a file of up to 1 MB may take
ROOM = 64 << 20  # bytes of memory that any file may take
TIMES = 125  # and this often its own size: compressed files may unpack to 50 times it, and are held twice meanwhile


@dataclass
class Findings:
    reader: str
    files: int = 0
    valid: int = 0
    seconds: float = 0.0
    slowest: float = 0.0
    peak: int = 0
    findings: list[tuple[int, Outcome]] = field(default_factory=list)

    def line(self) -> str:
        return (
            f"{self.reader}: {self.files} files, {self.valid} valid, {len(self.findings)} findings, slowest "
            f"{self.slowest:.2f} s, most memory {self.peak >> 20} MiB, {self.seconds:.0f} s in all"
        )

    def figures(self) -> dict[str, Any]:
        return {**vars(self), "findings": [number for number, _ in self.findings]}


def fuzz(reader: str, numbers: Iterable[int], folder: Path, keep: Path | None = None) -> Findings:
    """Read the damaged files of these numbers; folder: for seeds and files. keep: for files that are findings."""
    corpus, place = folder / "seeds", folder / "file"
    write_seeds(reader, corpus)
    worker = Worker(partial(prepared, reader, corpus))
    found = Findings(reader)
    try:
        for number in numbers:
            seed, file = damage(reader, corpus, number, place)
            size = file.stat().st_size
            outcome = judged(worker.read((seed, number)), size)
            found.files += 1
            found.valid += outcome.ended == "valid"
            found.seconds += outcome.seconds
            found.slowest = max(found.slowest, outcome.seconds)
            found.peak = max(found.peak, outcome.peak)
            if outcome.ended not in ("valid", "refused"):
                found.findings.append((number, outcome))
                if keep is not None:
                    shutil.copytree(place, keep / f"{reader}-{number}", dirs_exist_ok=True)
    finally:
        worker.close()
    return found


def judged(outcome: Outcome, size: int) -> Outcome:
    """The same, or a finding when a file of that size took too long or too much memory."""
    if outcome.ended in ("valid", "refused"):
        if outcome.seconds > SMALL_S * max(1, size / 1e6):
            return replace(outcome, ended="slow", said=f"{size} bytes: {outcome.said}")
        if outcome.peak > ROOM + TIMES * size:
            return replace(outcome, ended="memory", said=f"{size} bytes: {outcome.said}")
    return outcome


def prepared(reader: str, corpus: Path) -> Callable[[tuple[Seed, int]], Outcome]:
    """What a worker does with a file; before, it reads the undamaged seeds, so that imports are not measured."""
    for seed in seeds(reader, corpus):
        said = guarded_read((seed, 0))
        assert said.ended in ("valid", "refused"), f"{seed}: {said}"
    return guarded_read


def guarded_read(file: tuple[Seed, int]) -> Outcome:
    return watched(partial(read, *file))
