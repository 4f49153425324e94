"""Kinematics that mean the same thing from every camera; the parts are `pcnet3d.pipeline`, `.adapters`, `.models` and
`.stages`."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    __version__: str

__all__ = ["__version__"]


def __getattr__(name: str) -> str:
    """`__version__` when it is asked for: most who import a part never do."""
    if name == "__version__":
        from .pipeline.core.pose import package_version

        return package_version()
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
