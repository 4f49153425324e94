"""What is fitted on data, and what a run needs of it: detectors, lifters, rectifiers, up, gait, stated errors."""

from typing import TYPE_CHECKING

from ..pipeline.core.faces import lazily

if TYPE_CHECKING:
    from .detector.load import load_detector
    from .detector.protocols import Detector, Found, PersonNetwork
    from .gravity.images import up_from_images
    from .gravity.live import LiveRectifier
    from .lifter.builtin import LiveLifter
    from .lifter.load import load_lifter
    from .rectifier.load import load_rectifier

__all__ = [
    "Detector", "Found", "LiveLifter", "LiveRectifier", "PersonNetwork",
    "load_detector", "load_lifter", "load_rectifier", "up_from_images",
]  # fmt: skip

__getattr__, __dir__ = lazily(__name__)
