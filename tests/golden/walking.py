"""A person who walks, squats and raises both arms, as the person of golden files."""

from functools import cached_property

import numpy as np

from golden.bodies import Person
from golden.detections import Scene
from pcnet3d.examples.walker.camera import Camera, aimed, side_camera
from pcnet3d.examples.walker.landmarks import halpe26
from pcnet3d.examples.walker.walk import Walk, walker
from pcnet3d.pipeline import H36M17
from pcnet3d.pipeline.core.layouts import HALPE26, Layout
from pcnet3d.pipeline.core.rotations import rotate

FPS, SECONDS = 15, 20  # so few frames a second that the 40 of most golden files are some steps
SIZE, FOCAL_PX, FRAMES = (1280, 720), 1000.0, 90  # of what cameras see
_NOISE_M, _NOISE_PX = 0.004, 1.0
_CAMERAS = (
    (100, -250),
    (60, 250),
)  # where they look, degrees, and how far their images are moved to the right, pixels


_LANDMARKS = {"olecranon": "elbow", "cubital_fossa": "elbow", "acromion": "shoulder"}


def _beside(joint: str, names: tuple[str, ...]) -> str:
    """The joint of the walker for one that it lacks: that of the arm for its landmarks, the wrist for fingers."""
    if joint in names:
        return joint
    side, part = joint.split("_", 1)
    return f"{side}_{_LANDMARKS.get(part, 'wrist')}"


class Walking(Person):
    """The built-in walker before tilted cameras, with noise."""

    @cached_property
    def _walk(self) -> Walk:
        return walker(fps=FPS, seconds=SECONDS)

    @cached_property
    def _world(self) -> np.ndarray:
        world = self._walk.world
        return world + _NOISE_M * np.random.default_rng(0).standard_normal(world.shape)

    def turning(self, count: int) -> np.ndarray:
        """(count, 17, 3) metres in CAMERA, pelvis at the origin."""
        bodies = self._world - self._world[:, [H36M17.index("pelvis")]]
        return rotate(side_camera(self._walk).R_camera_from_world, bodies)[:count]

    def standing(self, count: int) -> np.ndarray:
        """(count, 17, 3) metres, z up."""
        return self._world[:count]

    def two_in_images(self, layout: Layout) -> Scene:
        """The walker as two cameras see them, one image beside the other."""
        points = np.concatenate([halpe26(self._walk), self._walk.world], axis=1)
        names = (*HALPE26.joints, *H36M17.joints)
        points = points[:FRAMES, [names.index(_beside(joint, names)) for joint in layout.joints]]
        scene = {}
        for number, (heading_deg, aside_px) in enumerate(_CAMERAS):
            pixels = _camera(points, heading_deg).project(points) + np.array([aside_px, 0])
            rng = np.random.default_rng(number)
            scores = rng.uniform(0.3, 1.0, pixels.shape[:2])
            pixels = pixels + _NOISE_PX * rng.standard_normal(pixels.shape)
            scene[str(number)] = np.arange(FRAMES), np.concatenate([pixels, scores[..., None]], axis=-1)
        return scene


def _camera(points: np.ndarray, heading_deg: float) -> Camera:
    turned = aimed(points.mean(axis=(0, 1)), 14.0, heading_deg, pitch_deg=8, roll_deg=3)
    return Camera(turned.R_camera_from_world, turned.position, FOCAL_PX, *SIZE)
