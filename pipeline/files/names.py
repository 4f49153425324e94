"""Names of a run's files and of what is in them, for those who need not open them."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from .atomic import REPORT

RECORDING = "take.rrd"
POSES, KINEMATICS, KEYPOINTS = "poses.npz", "kinematics.parquet", "keypoints.npz"
PAGES = (REPORT, "study.html", "compare.html")
# Arrays of POSES that a Rectified has by the same names.
OF_RECTIFIED = (
    "R_source_from_body", "R_source_from_level", "error_deg", "up_error_deg", "up_bound_deg", "up_votes",
)  # fmt: skip
BoneNames = Literal["joints", "mixamo"]  # of animated skeletons


def find_page(folder: Path) -> Path | None:
    """The page to read in a folder of results; None where there is none."""
    return next((folder / name for name in PAGES if (folder / name).is_file()), None)
