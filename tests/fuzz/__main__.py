"""Damaged files for every reader: `PYTHONPATH=tests python -m fuzz [READER ...] [--count N] [--first N]`.

Every file must give a valid result or an InputError of one line, in 1 s of CPU time and in memory bounded by its size.
Anything else is a finding: it is printed with its number and kept, and `--first NUMBER --count 1` makes it again. The
exit code is 1 when there was one.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

from fuzz.guarded import Worker
from fuzz.readers import names, read
from fuzz.run import fuzz

_SHOWN = 10

if __name__ == "__main__":
    parser = argparse.ArgumentParser(prog="python -m fuzz", description=__doc__)
    parser.add_argument("readers", nargs="*", default=[], help=", ".join(names()))
    parser.add_argument("--count", type=int, default=1000, help="files for each reader")
    parser.add_argument("--first", type=int, default=0, help="number of the first file")
    parser.add_argument("--keep", type=Path, help="folder for the files that are findings")
    given = parser.parse_args()
    found, worker = 0, Worker(read)
    for reader in given.readers or names():
        with TemporaryDirectory(prefix="fuzz-") as folder:
            result = fuzz(
                reader, range(given.first, given.first + given.count), Path(folder), worker, given.keep
            )
        found += len(result.findings)
        print(result.line(), flush=True)
        kinds = Counter(
            f"{outcome.ended}: {' '.join(outcome.said.split())[-150:]}" for _, outcome in result.findings
        )
        for number, outcome in result.findings[:_SHOWN]:
            print(
                f"  {number} {outcome.ended}, {outcome.seconds:.2f} s, {outcome.peak >> 20} MiB: {outcome.said[:600]}"
            )
        for kind, count in kinds.most_common():
            print(f"  {count} x {kind}")
    worker.close()
    sys.exit(1 if found else 0)
