"""C3D files whose points are joint centres; formats.md section 6.

Units and rate are in POINT UNITS and POINT RATE, a negative residual marks a missing point. The axes are the
laboratory's: +z is taken for up unless POINT Y_SCREEN says +Y or the option `up` does. Which video frame a row is
cannot be known.
"""

from __future__ import annotations

from pathlib import Path

from ..pipeline.core.errors import naming
from ..pipeline.core.pose import PoseSequence
from ..pipeline.files.markers import Up, read_c3d
from .kit.opened import first_bytes
from .kit.world import Maker, maker, people_of

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


def read(
    path: Path, unit: str | None = None, up: Up | None = None, made_by: Maker | None = None
) -> tuple[PoseSequence, ...]:
    """The person of the file, or each of its subjects by name, in the file's own world and unit, with time stamps from
    its rate.

    unit: "m", "mm", "cm" or "inch", instead of the file's. up: "y" or "z", the axis that is up; without it the person
    has to stand along the one that is taken for up. made_by: "measured" or "estimated"; without it a C3D file is motion
    capture's, but for our own and those of programs that need no markers, by the name in MANUFACTURER. InputError when
    the file is no C3D, or its points are not joint centres under names in use.
    """
    with naming(path):
        markers = read_c3d(path)
    return people_of(markers, str(path), unit, up, maker(made_by, markers.made_by))
