"""Two estimators of one video before and after rectification: `python tests/bench/bench_agreement.py`.

Prints the angle of the rotation that separates MotionBERT's body from BlazePose's in every frame of the boxing
recording (Kabsch over the 17 joints). There is no truth here; two views of one person should become one.
Needs the data folder (PCNET3D_DATA).
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from pcnet3d.pipeline import CAMERA, H36M17, PoseSequence, remap
from pcnet3d.pipeline.layouts import BLAZEPOSE33
from pcnet3d.pipeline.rotations import geodesic_deg, kabsch
from pcnet3d.stages import rectify

DATA = Path(os.environ.get("PCNET3D_DATA", Path(__file__).resolve().parents[3] / "shared" / "data"))


def apart_deg(a: PoseSequence, b: PoseSequence) -> np.ndarray:
    """(T,) degrees between two skeletons of the same frames."""
    return geodesic_deg(kabsch(a.joints.astype(float), b.joints.astype(float)), np.eye(3))


def main() -> None:
    with np.load(DATA / "lifter" / "boxing.npz") as file:
        motionbert = PoseSequence(file["motionbert"], H36M17, CAMERA.with_(origin="crop", unit="arbitrary"))
        blazepose = remap(PoseSequence(file["blazepose_world"], BLAZEPOSE33, CAMERA.with_(origin="mid-hips")))
    print("MotionBERT against BlazePose on boxing, degrees a frame: mean, p50, p95")
    pairs = {"camera axes": (motionbert, blazepose)}
    for rectifier in ("geometric", "pcnet"):
        a, b = (rectify(poses, rectifier) for poses in (motionbert, blazepose))
        pairs |= {f"BODY, {rectifier}": (a.body, b.body), f"LEVEL, {rectifier}": (a.level, b.level)}
    for name, (a, b) in pairs.items():
        apart = apart_deg(a, b)
        print(f"  {name:<18} {apart.mean():5.1f} {np.median(apart):5.1f} {np.percentile(apart, 95):5.1f}")


if __name__ == "__main__":
    main()
