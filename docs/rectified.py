"""Draws real lifters' skeletons before and after rectification:  python docs/rectified.py OUT.png

One row a clip and frame: as the camera saw the body, then BODY from the left-hand side by the geometric rectifier and
by the network. The vertical line is up, through the pelvis. Needs the data folder (PCNET3D_DATA).
"""

from __future__ import annotations

import sys

import cv2
import numpy as np

from pcnet3d.models import load_rectifier
from pcnet3d.models.common.metrics import relative
from pcnet3d.models.lab.clips import data_folder
from pcnet3d.pipeline.core.conversions import remap
from pcnet3d.pipeline.core.frames import CAMERA
from pcnet3d.pipeline.core.layouts import BLAZEPOSE33, H36M17, Layout
from pcnet3d.pipeline.core.pose import PoseSequence
from pcnet3d.pipeline.core.rotations import rotate, transpose
from pcnet3d.stages.drawing.palette import side_colour

# By clip: an array of its file in the data folder, whose lifter gave it, and the array's layout.
CLIPS: dict[str, tuple[tuple[str, str, Layout], ...]] = {
    "boxing": (("motionbert", "MotionBERT", H36M17), ("blazepose_world", "BlazePose", BLAZEPOSE33)),
    "walk_crop": (("blazepose_world", "BlazePose", BLAZEPOSE33),),
    "demo_man": (("blazepose_world", "BlazePose", BLAZEPOSE33),),
    "mhformer_skating": (("run_a", "MHFormer", H36M17),),
}
CELL, SHARE = 200, (0.3, 0.7)  # pixels of a cell's side; where in a clip the frames are taken
HEADINGS = (
    "camera",
    "BODY, geometric, from its left",
    "BODY, pcnet, from its left",
    "BODY, pcnet, from the front",
)


def cell(picture: np.ndarray, label: str) -> np.ndarray:
    """picture: (17, 2) x to the right, y up, in body heights."""
    image = np.full((CELL, CELL, 3), 255, np.uint8)
    cv2.line(image, (CELL // 2, 20), (CELL // 2, CELL - 8), (225, 225, 225), 1)
    at = CELL * (0.5 + 0.8 * picture * (1, -1))
    for bone in H36M17.bones:
        ends = at[H36M17.indices(bone)].round()
        if np.isfinite(ends).all():
            red, green, blue = side_colour(*bone)
            start, end = ends.astype(int).tolist()
            cv2.line(image, start, end, (blue, green, red), 3, cv2.LINE_AA)
    cv2.putText(image, label, (6, 14), cv2.FONT_HERSHEY_SIMPLEX, 0.38, (60, 60, 60), 1, cv2.LINE_AA)
    return image


def row(clip: str, lifter: str, joints: np.ndarray, frame: int) -> np.ndarray:
    one = joints[frame : frame + 1]
    height = np.ptp(one[0], axis=0).max()
    bodies = [
        rotate(transpose(load_rectifier(name).rotation(one)[0]), one)[0] / height
        for name in ("geometric", "pcnet")
    ]
    camera = one[0] / height
    # BODY: the person faces -x, the right hand is at +y; seen from its left, it faces to the left.
    pictures = [
        camera[:, :2] * (1, -1),
        bodies[0][:, [0, 2]],
        bodies[1][:, [0, 2]],
        bodies[1][:, [1, 2]] * (-1, 1),
    ]
    labels = [f"{clip}, {lifter}, frame {frame}", *HEADINGS[1:]]
    return np.hstack([cell(picture, label) for picture, label in zip(pictures, labels, strict=True)])


def main() -> None:
    rows = []
    for clip, lifters in CLIPS.items():
        with np.load(data_folder() / "lifter" / f"{clip}.npz", allow_pickle=False) as file:
            for array, lifter, layout in lifters:
                poses = remap(PoseSequence(file[array], layout, CAMERA.with_(unit="arbitrary")))
                joints = relative(poses.joints.astype(np.float64))
                rows += [
                    row(clip.removeprefix("mhformer_"), lifter, joints, int(share * len(joints)))
                    for share in SHARE
                ]
    half = len(rows) // 2
    cv2.imwrite(sys.argv[1], np.hstack([np.vstack(rows[:half]), np.vstack(rows[half:])]))


if __name__ == "__main__":
    main()
