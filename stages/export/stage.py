"""The files of a run: poses.npz, kinematics.parquet, measures.csv, strides.csv and summary.json (design.md section 7),
and others on request."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from ...pipeline.core.camera import Camera, pitch_roll_deg
from ...pipeline.core.errors import InputError
from ...pipeline.core.measures import nested
from ...pipeline.core.pose import PoseSequence, Rectified, package_version
from ...pipeline.core.rotations import rotate
from ...pipeline.core.system import cores
from ...pipeline.core.take import Take, Told
from ...pipeline.files.arrays import write_arrays
from ...pipeline.files.atomic import REPORT, SUMMARY, plain, write_json
from ...pipeline.files.names import KEYPOINTS, KINEMATICS, OF_RECTIFIED, POSES, RECORDING, BoneNames
from ...pipeline.plugins.protocols import Writer
from ...pipeline.plugins.registry import load
from ...pipeline.running.sentences import judgement
from ..drawing.facts import mean
from .tables import write_measures, write_parquet, write_strides

# What runs write by themselves (design.md section 7), `live` included.
RUN_FILES = (
    POSES, KINEMATICS, "measures.csv", "strides.csv", SUMMARY, REPORT, RECORDING, KEYPOINTS, "video.ts",
)  # fmt: skip

_OF_CAMERA = ("focal_px", "focal_sd_px", "focal_source", "image_size")


@dataclass(frozen=True)
class Export:
    """The stage. folder: where the files go. also: names of `pcnet3d list writers`, each of which becomes one more
    file; InputError for one that would replace another file of the run. names: of the bones of animated skeletons."""

    folder: Path
    also: tuple[str, ...] = ()
    names: BoneNames = "joints"

    name: ClassVar[str] = "export"
    needs: ClassVar[tuple[str, ...]] = ("poses", "rectified", "kinematics")
    gives: ClassVar[tuple[str, ...]] = ()
    reads: ClassVar[tuple[str, ...]] = ("images",)

    def __post_init__(self) -> None:
        files = {file: "the run itself" for file in RUN_FILES}
        for name, writer in self._writers().items():
            other = files.setdefault(writer.file.casefold(), f"writer '{name}'")
            if other != f"writer '{name}'":
                raise InputError(
                    "option-conflict",
                    f"Expected --also {name} to write a file of its own, got {writer.file}, which {other} writes; "
                    f"leave --also {name} out.",
                )
            if check := getattr(writer, "check", None):
                check()
        if self.names != "joints" and not any(map(_has_bones, self._writers().values())):
            raise InputError(
                "option-conflict",
                f"Expected a file with bones for export.names={self.names}, and none is asked for; add --also glb or "
                "--also bvh.",
            )

    def check_told(self, told: Told) -> None:
        """InputError where a file would hold images of the person and none are wanted."""
        for name, writer in self._writers().items():
            if not told.images and getattr(writer, "images", False):
                raise InputError(
                    "option-conflict",
                    f"Expected no file with images of the person (--no-frames), got --also {name}, which writes "
                    f"{writer.file}; leave one of the two out.",
                )

    def check_unit(self, unit: str) -> None:
        """InputError where a file would hold metres and there are none."""
        for name, writer in self._writers().items():
            if unit == "arbitrary" and getattr(writer, "metric", False):
                raise InputError(
                    "needs-input",
                    f"Expected a scale for --also {name}, whose {writer.file} holds metres, and the source has none; "
                    "give the person's height (--stature METRES).",
                )

    def __call__(self, take: Take) -> Take:
        self.check_told(take.told)
        self.folder.mkdir(parents=True, exist_ok=True)
        files = {POSES: write_poses, KINEMATICS: write_parquet}
        if take.measures is not None:
            files |= {"measures.csv": write_measures, "strides.csv": write_strides}
        with ThreadPoolExecutor(cores()) as pool:  # half of it is compression, which leaves Python to others
            list(pool.map(lambda file: files[file](take, self.folder / file), files))
        for writer in self._writers().values():
            options = {"names": self.names} if _has_bones(writer) else {}
            take = take.saying(*(writer.write(take, self.folder / writer.file, **options) or ()))
        write_json(self.folder / SUMMARY, summary(take))
        return take

    def _writers(self) -> dict[str, Writer]:
        return {name: load("writers", name) for name in self.also}


def _has_bones(writer: Writer) -> bool:
    return getattr(writer, "bones", False)


def write_poses(take: Take, path: Path) -> None:
    """poses.npz: plain arrays `source`, `level`, `body` (T, J, 3) of the joints `joint_names` (J,), in the source's
    `unit`: those of H36M17, and behind them heels and toes where the source has some; the rotations
    `R_source_from_body` (T, 3, 3) and `R_source_from_level` (3, 3), or (T, 3, 3) of a moving camera, where back and
    right in `level` are relative to it; how far to trust them, `error_deg`, `up_error_deg`, `up_bound_deg` (T,),
    `up_votes` (T, 3); `time_s` and `frame_index` (T,).

    `root` (T, 3) is the pelvis in the axes of `level`, from the camera's centre or the world's origin: `level` + `root`
    are places in the room; NaN where they are not known. `root_sd` (T, 3) is the standard deviation of its error along
    these axes where it was estimated (stages/place.py), NaN where the source knew it.
    `filtered` (T, J, 3) is what kinematics rest on, in the axes of `level`. Keypoints, where the take has some, have
    rows of their own: `keypoints` (N, K, 2) pixels, `keypoints_confidence` (N, K), `keypoints_time_s` and
    `keypoints_frame_index` (N,), and `keypoints_names` (K,)."""
    poses = take.need("poses")
    rectified = take.need("rectified")
    level = rectified.level
    sd = level.path and level.path.sd
    more: dict[str, Any] = {} if take.filtered is None else {"filtered": take.filtered.joints}
    if (keypoints := take.keypoints) is not None:
        more |= {
            "keypoints": keypoints.joints,
            "keypoints_confidence": keypoints.confidence,
            "keypoints_frame_index": keypoints.frame_index,
            "keypoints_names": np.array(keypoints.layout.joints),
        }
        if keypoints.time_s is not None:
            more["keypoints_time_s"] = keypoints.time_s
    write_arrays(
        path,
        source=poses.joints,
        level=level.joints,
        body=rectified.body.joints,
        root=np.broadcast_to(np.nan, (len(poses), 3)) if level.root is None else level.root,
        root_sd=np.broadcast_to(np.nan, (len(poses), 3)) if sd is None else sd,
        **{name: getattr(rectified, name) for name in OF_RECTIFIED},
        time_s=poses.times,
        frame_index=poses.frame_index,
        joint_names=np.array(poses.layout.joints),
        unit=np.array(poses.frame.unit),
        **more,
    )


def _about(poses: PoseSequence) -> dict[str, Any]:
    """What summary.json says about poses or keypoints beside their arrays, to read the run back."""
    return {
        "person": poses.person,
        "frames_known": poses.frames_known,
        "made_by": asdict(poses.made_by),
        "derived": sorted(poses.derived),
        "seams": list(poses.seams),
    }


def summary(take: Take) -> dict[str, Any]:
    """Provenance, notices and the take's figures, ready for JSON (no NaN)."""
    poses, rectified = take.need("poses"), take.need("rectified")
    up_error_deg = np.where(np.isfinite(rectified.up_bound_deg), rectified.up_error_deg, np.nan)
    content = {
        "pcnet3d": package_version(),
        "take": take.name,
        "session": {key: value for key, value in asdict(take.session).items() if value},
        "told": asdict(take.told),
        "inputs": take.inputs,
        "verdict": take.verdict,
        "judgement": judgement(take),
        "notices": [each.as_dict() for each in take.said],
        "poses": {
            "frames": len(poses),
            "first_frame": int(poses.frame_index[0]),
            "fps": poses.fps,
            "duration_s": poses.duration_s,
            "frame": asdict(poses.frame),
            "unit": poses.frame.unit,
            **_about(poses),
            "root_shared": poses.path and poses.path.shared,
            "steps": len(poses.history),
        },
        "keypoints": None
        if take.keypoints is None
        else {"layout": take.keypoints.layout.name, **_about(take.keypoints)},
        "rectification": {
            "method": rectified.method,
            "camera": rectified.camera,
            "frames_rectified": int(rectified.turned.sum()),
            "error_deg_mean": mean(rectified.error_deg),
            **_up("up_error_deg", up_error_deg, rectified),
            **_up("up_bound_deg", rectified.up_bound_deg, rectified),
            "up_shares": rectified.up_shares,
            "up_by_source": _up_by_source(take),
            "level_heading": rectified.level_heading,
            "level_ok": rectified.level_ok,
            "level_reason": rectified.level_reason,
            "steps": len(rectified.level.history),
        },
        "camera": _camera(take.camera),
        "cutoff_hz": take.cutoff_hz,
        "angle_errors": take.angle_errors,
        "measures": None if take.measures is None else nested(take.measures),
        "history": [asdict(step) for step in take.history],
    }
    return plain(content)


def _camera(camera: Camera | None) -> dict[str, Any] | None:
    """The camera's focal length, where it comes from, and how it moves."""
    if camera is None:
        return None
    return {
        **{name: getattr(camera, name) for name in _OF_CAMERA},
        "no_up_reason": camera.reason,
        "background": camera.background and asdict(camera.background),
    }


def _up_by_source(take: Take) -> dict[str, dict[str, float]]:
    """What each source of up says: pitch and roll of the camera by it alone, with their root mean square error; and its
    weight in the take's up, where it was heard."""
    rectified, to_camera = take.need("rectified"), take.need("poses").frame.basis.T
    told = {name: {"share": share} for name, share in rectified.up_shares.items()}
    for name, (up, error_deg) in rectified.up_own.items():
        pitch_deg, roll_deg = pitch_roll_deg(rotate(to_camera, up[None])[0]).tolist()
        told.setdefault(name, {}).update(pitch_deg=pitch_deg, roll_deg=roll_deg, error_deg=error_deg)
    return told


def _up(name: str, values: np.ndarray, rectified: Rectified) -> dict[str, float]:
    """One figure for the take, or the mean and the largest of a moving camera's frames that are rectified."""
    if rectified.camera != "moving":
        return {name: mean(values)}
    values = values[rectified.turned]
    usual = mean(values)
    return {f"{name}_mean": usual, f"{name}_max": float(np.nanmax(values)) if np.isfinite(usual) else usual}
