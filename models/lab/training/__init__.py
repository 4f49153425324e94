"""Training of the built-in networks, a script each."""

from typing import Literal

Device = Literal["auto", "cpu", "cuda"]
