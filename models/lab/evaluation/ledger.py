"""The ledger of looks at the test sets: who is looked at often is no test any more."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from datetime import date
from pathlib import Path

ROOT = Path(__file__).parents[3]
_HEAD = ("date", "command", "networks", "because")


def ledger_of(output: Path) -> Path:
    """docs/accuracy/ledger.csv where this package lies in its repository, else ledger.csv in the report's folder."""
    return ROOT / "docs" / "accuracy" / "ledger.csv" if (ROOT / ".git").exists() else output / "ledger.csv"


def note_look(output: Path, command: str, networks: Sequence[str], because: str) -> None:
    """Append a line to the ledger: the day, the command, the networks with their digests, and why."""
    path = ledger_of(output)
    first = not path.exists()
    with open(path, "a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if first:
            writer.writerow(_HEAD)
        writer.writerow([date.today().isoformat(), command, " ".join(networks), " ".join(because.split())])
