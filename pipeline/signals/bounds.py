"""What no recording of a person has: times beyond any session, rates of no camera, bodies of no size."""

from __future__ import annotations

import numpy as np

from ..core.errors import InputError
from ..core.pose import PoseSequence
from ..core.rotations import is_finite
from .filters import rate
from .rates import RATES

_LONGEST_S = 1e6  # eleven days
_SIZES = (
    1e-4,
    1e7,
)  # of a body in any unit, pixels among them: a child in kilometres, an adult in micrometres
_FARTHEST = 1e9  # from the origin


def check_times(time_s: np.ndarray, where: str) -> None:
    """InputError for times (T,) beyond a million seconds, and for fewer than 1 or more than 1,000 rows a second."""
    if np.abs(time_s).max(initial=0) > _LONGEST_S:
        worst = float(time_s[np.abs(time_s).argmax()])
        raise InputError(
            "times-broken",
            f"{where}: expected times within {_LONGEST_S:.0f} s, got {worst:.6g} s; count seconds from the recording's "
            "begin, or give the frame rate (--fps).",
        )
    fps = rate(time_s)
    if np.isfinite(fps) and not RATES[0] <= fps <= RATES[1]:
        raise InputError(
            "times-broken",
            f"{where}: expected {RATES[0]:g} to {RATES[1]:g} rows a second, got {fps:.3g}: its times go on by "
            f"{1 / fps:.3g} s; if these are other units, such as milliseconds, write seconds, or give the frame rate "
            "(--fps).",
        )


def check_size(poses: PoseSequence, where: str) -> None:
    """InputError for bodies, in 2D or 3D, of no size that a unit could have, or as far away as nobody is."""
    known = is_finite(poses.joints).sum(axis=1)
    if not known.any():
        return
    high, low = (f.reduce(poses.joints, axis=1).astype(np.float64) for f in (np.fmax, np.fmin))
    far = float(max(np.nanmax(high), -np.nanmin(low)))
    extent = (high - low)[known > 1] if (known > 1).any() else np.ones((1, 1))
    size = float(np.nanmedian(extent, axis=0).max())
    if size != 0 and not (_SIZES[0] <= size <= _SIZES[1] and far <= _FARTHEST):  # of size 0 is a failed frame
        raise InputError(
            "wrong-axes",
            f"{where}: expected a body of {_SIZES[0]:g} to {_SIZES[1]:g} units, within {_FARTHEST:g} of the origin, "
            f"got one of {size:.3g}, up to {far:.3g} away; write coordinates in metres, or in pixels for keypoints.",
        )
