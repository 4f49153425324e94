"""A lifter that makes a person a cardboard figure, upright and facing the camera: put your own network in `stand`."""

import numpy as np

from pcnet3d.pipeline import CAMERA, H36M17, InputError, Lifted, ToLift, remap

what = "the person as a cardboard figure, upright and facing the camera"

LEVEL = np.array([0.0, -1.0, 0.0])  # up in a camera that looks neither up nor down


class Cardboard:
    method, unit = "cardboard@1", "arbitrary"
    takes = ("gaps", "up", "guessed focal")

    def lift(self, asked: ToLift) -> Lifted:
        """Each joint where its ray meets the figure; missing joints stay missing."""
        if asked.image_size is None:
            raise InputError(
                "needs-input",
                "Expected the image's size; give the video or --set read.image_size=WIDTHxHEIGHT.",
            )
        size = np.array(asked.image_size)
        focal_px = asked.focal_px or float(size.max())
        keypoints = remap(asked.keypoints, H36M17)
        rays = np.pad((keypoints.joints - size / 2) / focal_px, ((0, 0), (0, 0), (0, 1)), constant_values=1)
        up = np.broadcast_to(LEVEL if asked.up is None else asked.up, (len(rays), 3))
        up = np.where(np.isnan(up), LEVEL, up)
        joints = np.stack([stand(*row) for row in zip(rays, up, strict=True)])
        poses = keypoints.with_(joints=joints, frame=CAMERA.with_(origin="pelvis", unit=self.unit))
        told = {"focal_px": focal_px, "focal_known": asked.focal_known, "up_known": asked.up is not None}
        return Lifted(poses, self.method, "cardboard", **told)


def stand(rays: np.ndarray, up: np.ndarray) -> np.ndarray:
    """(17, 3) joints about the pelvis, which is at a distance of 1, of rays (17, 3) and up (3,), both in CAMERA."""
    pelvis = rays[H36M17.index("pelvis")]
    facing = pelvis - (pelvis @ up) * up
    return rays * ((pelvis @ facing) / (rays @ facing))[:, None] - pelvis


def open() -> Cardboard:
    return Cardboard()
