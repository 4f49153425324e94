"""Names of a run's files, for those who need not open them."""

from __future__ import annotations

from pathlib import Path

from .atomic import REPORT

RECORDING = "take.rrd"
POSES, KINEMATICS, KEYPOINTS = "poses.npz", "kinematics.parquet", "keypoints.npz"
PAGES = (REPORT, "study.html", "compare.html")


def find_page(folder: Path) -> Path | None:
    """The page to read in a folder of results; None where there is none."""
    return next((folder / name for name in PAGES if (folder / name).is_file()), None)
