"""The files of a run: poses.npz, kinematics.parquet, summary.json (design.md section 7)."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ..pipeline.checks import bone_spread
from ..pipeline.outputs import SUMMARY, whole_file
from ..pipeline.pose import package_version
from ..pipeline.rotations import angle_deg
from ..pipeline.take import Take


@dataclass(frozen=True)
class Export:
    """The stage. folder: where the files go."""

    folder: Path

    name: ClassVar[str] = "export"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified", "kinematics")
    gives: ClassVar[tuple[str, ...]] = ()

    def __call__(self, take: Take) -> Take:
        self.folder.mkdir(parents=True, exist_ok=True)
        write_poses(take, self.folder / "poses.npz")
        write_kinematics(take, self.folder / "kinematics.parquet")
        text = json.dumps(summary(take), indent=1, allow_nan=False, default=str)
        with whole_file(self.folder / SUMMARY) as partial:
            partial.write_text(text + "\n", encoding="utf-8")
        return take


def write_poses(take: Take, path: Path) -> None:
    """poses.npz: plain arrays `source`, `level`, `body` (T, 17, 3) and the rotations between them."""
    assert take.poses is not None
    assert take.rectified is not None
    rectified = take.rectified
    with whole_file(path) as partial, open(partial, "wb") as file:
        np.savez_compressed(
            file,
            source=take.poses.joints,
            level=rectified.level.joints,
            body=rectified.body.joints,
            R_source_from_body=rectified.R_source_from_body,
            R_source_from_level=rectified.R_source_from_level,
            error_deg=rectified.error_deg,
            time_s=take.poses.times,
            frame_index=take.poses.frame_index,
            joint_names=np.array(take.poses.layout.joints),
            unit=np.array(take.poses.frame.unit),
        )


def write_kinematics(take: Take, path: Path) -> None:
    """kinematics.parquet: one row a frame, every column's unit in its name."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    assert take.poses is not None
    assert take.kinematics is not None
    columns = {"frame": take.poses.frame_index, "time_s": take.poses.times, **take.kinematics}
    table = pa.table(columns).replace_schema_metadata({"pcnet3d": package_version(), "take": take.name})
    with whole_file(path) as partial:
        pq.write_table(table, partial)


def summary(take: Take) -> dict[str, Any]:
    """Provenance, warnings, repairs and the take's figures, ready for JSON (no NaN)."""
    assert take.poses is not None
    assert take.rectified is not None
    poses, rectified = take.poses, take.rectified
    ups = rectified.R_source_from_body[:, :, 2]
    deviation = angle_deg(ups, rectified.R_source_from_level[..., :, 2])
    content = {
        "pcnet3d": package_version(),
        "take": take.name,
        "inputs": take.inputs,
        "warnings": [event.text for event in take.events if event.kind == "warning"],
        "repairs": [event.text for event in take.events if event.kind == "repair"],
        "notes": [event.text for event in take.events if event.kind == "note"],
        "poses": {
            "frames": len(poses),
            "first_frame": int(poses.frame_index[0]),
            "fps": poses.fps,
            "duration_s": float(poses.times[-1] - poses.times[0]),
            "source_frame": str(poses.frame),
            "unit": poses.frame.unit,
            "seams": list(poses.seams),
            "bone_length_spread": bone_spread(poses),
        },
        "rectification": {
            "method": rectified.method,
            "frames_rectified": int(np.isfinite(ups).all(axis=1).sum()),
            "error_deg_mean": _mean(rectified.error_deg),
            "up_deviation_deg_mean": _mean(deviation),
            "R_source_from_level": rectified.R_source_from_level.tolist(),
            "level_heading": rectified.level_heading,
            "level_ok": rectified.level_ok,
            "level_reason": rectified.level_reason,
        },
        "history": [asdict(step) for step in rectified.body.history],
    }
    return _plain(content)


def _mean(values: np.ndarray) -> float:
    return float(np.nanmean(values)) if np.isfinite(values).any() else float("nan")


def _plain(value: Any) -> Any:
    """The same in types that JSON has; NaN and infinity become null."""
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
