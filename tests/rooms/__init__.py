"""Photographs of rooms and streets whose cameras are known, rendered from a seed, and images without lines to tell by.

`indoors`, `streets` and `no_lines` draw what is seen, of `furniture`, `walls` and `plants`; `views` is the pinhole that
it is painted through, `spoilers` what a real camera adds, `shots` an image with its truth.
"""

from .indoors import room
from .no_lines import KINDS, no_lines
from .shots import Room
from .streets import street

__all__ = ["KINDS", "Room", "no_lines", "room", "street"]
