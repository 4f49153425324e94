"""How cameras are held."""

from __future__ import annotations

import numpy as np

from ...pipeline.core.camera import pitch_roll_deg

# Pitch about looking a little down, roll about none: middles and spreads in degrees; a few of them any way.
_USUAL_DEG = ((8.0, 14.0), (0.0, 5.0))
_ANYHOW_DEG, _ANYHOW = 35.0, 0.05


def held(up: np.ndarray) -> float:
    """How usual a camera of that up (3,) is: a density in pitch and roll over that of the most usual one."""
    usual = anyhow = 1.0
    for angle, (middle, spread) in zip(
        pitch_roll_deg(np.asarray(up, dtype=np.float64)), _USUAL_DEG, strict=True
    ):
        usual *= np.exp(-0.5 * ((angle - middle) / spread) ** 2)
        anyhow *= np.exp(-0.5 * ((angle - middle) / _ANYHOW_DEG) ** 2) * spread / _ANYHOW_DEG
    return float((1 - _ANYHOW) * usual + _ANYHOW * anyhow)
