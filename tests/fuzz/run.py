"""Many damaged files of one reader, each read under guard."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from fuzz.guarded import Outcome, Worker
from fuzz.readers import damage, seeds, write_seeds
from laps import lap_s

SMALL_LAPS = 20  # that a file of up to 1 MB may take, of CPU time: a second on a core of 3 GHz
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


def fuzz(
    reader: str, numbers: Iterable[int], folder: Path, worker: Worker, keep: Path | None = None
) -> Findings:
    """Read the damaged files of these numbers; folder: for seeds and files. keep: for files that are findings."""
    corpus, place = folder / reader, folder / "file"
    write_seeds(reader, corpus)
    _warm(reader, corpus, worker)
    found, lap = Findings(reader), _lap_s()
    for number in numbers:
        if worker.ended:
            worker.start()
            _warm(reader, corpus, worker)
        seed, file = damage(reader, corpus, number, place)
        outcome = judged(worker.read((seed, number)), file.stat().st_size, lap)
        found.files += 1
        found.valid += outcome.ended == "valid"
        found.seconds += outcome.seconds
        found.slowest = max(found.slowest, outcome.seconds)
        found.peak = max(found.peak, outcome.peak)
        if outcome.ended not in ("valid", "refused"):
            found.findings.append((number, outcome))
            if keep is not None:
                shutil.copytree(place, keep / f"{reader}-{number}", dirs_exist_ok=True)
    return found


@cache
def _lap_s() -> float:
    return lap_s()


def _warm(reader: str, corpus: Path, worker: Worker) -> None:
    """Read the undamaged seeds, so that imports are not measured."""
    for seed in seeds(reader, corpus):
        said = worker.read((seed, 0))
        assert said.ended in ("valid", "refused"), f"{seed}: {said}"


def judged(outcome: Outcome, size: int, lap: float) -> Outcome:
    """The same, or a finding when a file of that size took too long or too much memory. lap: of laps.lap_s."""
    if outcome.ended in ("valid", "refused"):
        if outcome.seconds > SMALL_LAPS * max(1, size / 1e6) * lap:
            return replace(outcome, ended="slow", said=f"{size} bytes: {outcome.said}")
        if outcome.peak > ROOM + TIMES * size:
            return replace(outcome, ended="memory", said=f"{size} bytes: {outcome.said}")
    return outcome
