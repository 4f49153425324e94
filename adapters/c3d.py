"""C3D files whose points are joint centres; formats.md section 6.

Units and rate are in POINT UNITS and POINT RATE, a negative residual marks a missing point. The axes are the
laboratory's: +z is taken for up unless POINT Y_SCREEN says +Y or the option `up` does. A C3D file is motion capture's,
but for our own and those of programs that need no markers, by the name in MANUFACTURER. Which video frame a row is
cannot be known.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.files.markers import read_c3d
from ..pipeline.files.opened import first_bytes
from .kit.world import reader_of

name = "c3d"
gives = "poses"
reads = "C3D with points at joint centres, z up"

_BLOCK = 512
_KEY = 0x50  # second byte of a C3D file
_PROCESSORS = (84, 85, 86)  # fourth byte of its parameters: Intel, and DEC and MIPS, which are refused


def sniff(path: Path) -> bool:
    """By the marks of the header and of the parameter block."""
    start = first_bytes(path, 256 * _BLOCK)
    if len(start) < 2 or start[0] == 0 or start[1] != _KEY:
        return False
    parameters = start[(start[0] - 1) * _BLOCK :]
    return len(parameters) >= 4 and parameters[3] in _PROCESSORS


read = reader_of(read_c3d)
