"""How many threads may compute at a time."""

from __future__ import annotations

import os


def cores() -> int:
    """The cores that were given to this process, which in a container may be fewer than the machine's; no more than
    OMP_NUM_THREADS says, where it is set: a batch runs one process for each core, with one thread."""
    given = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    most = os.environ.get("OMP_NUM_THREADS", "")
    return min(given, max(int(most), 1)) if most.isdecimal() else given
