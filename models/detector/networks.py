"""Networks that look at images: joints of the person in a part of one, and boxes around people; and what makes
detectors of them: one person followed, or everybody in boxes.

A person may be looked at twice, the second time mirrored and a little closer. What a network is off by changes with
where the joints fall on its grid and with which side is which, so the mean of both looks is off by less, and trembles
less from frame to frame (docs/video.md). Mirrored looks are the usual "flip test" of 2D pose estimation (e.g. Newell et
al., "Stacked Hourglass Networks", ECCV 2016).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from ...pipeline.core.errors import InputError
from ...pipeline.core.layouts import COCO17, COCO23, HALPE26, Layout
from ..common.onnx import OnnxFile
from .protocols import LOST, Crop, CropNetwork, Found, PersonNetwork, around, box_around, fitted

_JOINT_SEEN = 0.2  # score from which a joint counts as seen, of the published recipe
_HIPS = COCO17.indices(("l_hip", "r_hip"))
_TORSO = COCO17.indices(("l_shoulder", "r_shoulder", "l_hip", "r_hip"))
_TORSO_ROOM, _BODY_ROOM = 1.9, 1.2
MEAN = np.array([123.675, 116.28, 103.53], dtype=np.float32)
DEVIATION = np.array([58.395, 57.12, 57.375], dtype=np.float32)
_PEAK_SEEN = 0.3  # score from which a joint belongs into the person's box, MMPose's own threshold for drawing
LAYOUTS = {17: COCO17, 26: HALPE26, 133: COCO23}  # by number of joints, of which the first count
_SIDE = 640  # pixels, where the network takes any
_GREY = 114  # beyond the image, as it was trained
_SURE = 0.3  # score of a person, rtmlib's
_OVERLAP = 0.45  # of two boxes over their union, beyond which they are one person; rtmlib's
_FOUND = 0.5  # as sure as this of a second look, somebody was found
_HINT = 0.1  # as sure as this, a first look is worth a second
_CLOSER = 3  # looks more, each closer than the one before
_SECOND = 0.88  # the crop's size at the second look, as a share of what the network asks for
_SAME = 0.06  # of the person's size: answers nearer to each other than this mean the same point


class MoveNet:
    """MoveNet, a CropNetwork: 17 COCO joints of one person straight from the image.

    Inputs and outputs as on Google's model cards (movenet/singlepose/lightning, /thunder): (1, H, W, 3) RGB 0 to 255 ->
    (1, 1, 17, 3) y, x, score in shares of the input. The crop that follows a person is the published recipe's: around
    the hips, 1.9 times the reach of the torso or 1.2 times that of the body.
    """

    layout: Layout = COCO17
    aspect = 1.0
    room = 1.25

    def __init__(self, network: OnnxFile) -> None:
        self._network = network
        (shape,) = network.inputs.values()
        self._side = shape[1] or 192
        self.method = f"movenet@{network.digest}"

    def look(self, image: np.ndarray, crop: Crop) -> Found:
        """As CropNetwork says."""
        cropped = crop.cut(image, (self._side, self._side)).astype(self._network.input_dtype)
        answer = self._network.run(cropped[None])[0].reshape(17, 3)
        xy, score = crop.in_image(answer[:, 1::-1]), np.clip(answer[:, 2], 0, 1)
        seen = score > _JOINT_SEEN
        return Found(xy, score, box_around(xy[seen] if seen.any() else xy), float(score[_TORSO].mean()))

    def next_crop(self, person: Found) -> Crop:
        """As CropNetwork says."""
        centre = person.xy[_HIPS].mean(axis=0)
        off = np.abs(person.xy - centre).max(axis=1)
        body = off[person.score > _JOINT_SEEN].max(initial=0)
        side = 2 * max(_TORSO_ROOM * off[_TORSO].max(), _BODY_ROOM * body)
        return around(centre, side, side)


class SimCC:
    """RTMPose and its kin, a CropNetwork: each coordinate of the person in a crop is the peak of a row of bins (SimCC).

    As MMPose exports them: `simcc_x` (N, J, bins) and `simcc_y` (N, J, bins) for an input (N, 3, H, W), RGB less mean
    over deviation, an upright crop 1.25 times the person's box; the bins are a whole number of times finer than the
    pixels. The score is the lower of the two peaks (MMPose get_simcc_maximum), cut to [0, 1]. Of 133 joints
    (COCO-WholeBody) the body's 17 are kept.
    """

    room = 1.25

    def __init__(self, network: OnnxFile) -> None:
        (image,), joints = network.inputs.values(), network.outputs["simcc_x"][1]
        if joints not in LAYOUTS:
            raise InputError(
                "wrong-network",
                f"{network.path}: expected {', '.join(map(str, LAYOUTS))} joints of a person, got {joints}.",
            )
        if image[2] is None or image[3] is None:
            raise InputError(
                "wrong-network",
                f"{network.path}: expected a fixed height and width of the input, got {network.looks}; "
                "export it with its own input size.",
            )
        self._network = network
        self._size = (image[3], image[2])
        self.aspect = image[3] / image[2]
        self.layout: Layout = LAYOUTS[joints]
        self.method = f"simcc@{network.digest}"

    def look(self, image: np.ndarray, crop: Crop) -> Found:
        """As CropNetwork says."""
        cropped = (crop.cut(image, self._size) - MEAN) / DEVIATION
        bins = dict(
            zip(self._network.outputs, self._network.run(cropped.transpose(2, 0, 1)[None]), strict=True)
        )
        rows = [bins[name][0, : len(self.layout)] for name in ("simcc_x", "simcc_y")]
        shares = np.stack([row.argmax(axis=1) / row.shape[1] for row in rows], axis=1)
        xy = crop.in_image(shares)
        score = np.clip(np.minimum(*(row.max(axis=1) for row in rows)), 0, 1)
        seen = score > _PEAK_SEEN
        return Found(xy, score, box_around(xy[seen] if seen.any() else xy), float(score.mean()))

    def next_crop(self, person: Found) -> Crop:
        """As CropNetwork says."""
        return fitted(person.box, self.aspect, self.room)


class PersonBoxes:
    """YOLOX, a PersonNetwork, as MMDeploy and rtmlib export it.

    Input (1, 3, H, W), BGR 0 to 255; outputs `dets` (1, N, 5) left, top, right, bottom, score in pixels of the input,
    boxes that overlap removed in the network, and `labels` (1, N), 0 for a person, unless it finds nothing else.
    """

    def __init__(self, network: OnnxFile) -> None:
        images, shapes = list(network.inputs.values()), list(network.outputs.values())
        boxes = [i for i, shape in enumerate(shapes) if len(shape) == 3 and (shape[2] or 5) == 5]
        labels = [i for i, shape in enumerate(shapes) if len(shape) == 2]
        takes_one = len(images) == 1 and len(images[0]) == 4 and images[0][1] == 3
        if not takes_one or len(boxes) != 1 or len(boxes) + len(labels) != len(shapes):
            raise InputError(
                "wrong-network", f"{network.path} is not a network that finds people: {network.looks}."
            )
        self._network = network
        self._size = (images[0][3] or _SIDE, images[0][2] or _SIDE)
        self._boxes, self._labels = boxes[0], labels[0] if labels else None
        self.method = f"people@{network.digest}"

    def boxes(self, image: np.ndarray) -> np.ndarray:
        """As PersonNetwork says, best first."""
        import cv2

        width, height = self._size
        scale = min(width / image.shape[1], height / image.shape[0])
        crop = Crop(0, 0, round(width / scale), round(height / scale))
        cropped = crop.cut(image, self._size, _GREY)[..., ::-1].astype(np.float32)
        answers = self._network.run(np.ascontiguousarray(cropped.transpose(2, 0, 1)[None]))
        rows = answers[self._boxes][0].astype(np.float64)
        if self._labels is not None:
            rows = rows[answers[self._labels][0] == 0]
        left_top, right_bottom, score = rows[:, :2], rows[:, 2:4], rows[:, 4]
        sized = np.hstack([left_top, right_bottom - left_top])
        # Of boxes that overlap much the best alone.
        kept = np.array(cv2.dnn.NMSBoxes(sized.tolist(), score.tolist(), _SURE, _OVERLAP), dtype=int).ravel()
        return crop.in_image(rows[kept, :4].reshape(-1, 2, 2) / self._size).reshape(-1, 4)


def looked_twice(network: CropNetwork, image: np.ndarray, crop: Crop) -> Found:
    """As CropNetwork.look at an image (H, W, 3), by two looks. Of a joint on which both agree the answer is their mean
    by their scores, of others that of the surer look."""
    first = network.look(image, crop)
    if first.sure < LOST:
        return first  # nor will another look see anybody
    # A smaller part about the same middle, of the mirrored image.
    centre = np.array([crop.left + crop.width / 2, crop.top + crop.height / 2])
    part = around(centre, _SECOND * crop.width, _SECOND * crop.height)
    width, other = image.shape[1], network.layout.mirror
    again = network.look(
        image[:, ::-1], Crop(width - part.left - part.width, part.top, part.width, part.height)
    )
    xy = np.stack([first.xy, np.array([width, 0]) + again.xy[other] * (-1, 1)])
    score = np.stack([first.score, again.score[other]])
    size = np.ptp(first.box.reshape(2, 2), axis=0).max()
    near = np.linalg.norm(xy[0] - xy[1], axis=-1) <= _SAME * size
    surer = np.array([score[0] >= score[1], score[0] < score[1]])
    counts = np.where(near, True, surer)  # (looks, J)
    weights = counts * np.maximum(score, 1e-6)
    mean = (weights[..., None] * xy).sum(axis=0) / weights.sum(axis=0)[:, None]
    return Found(mean, (counts * score).sum(axis=0) / counts.sum(axis=0), first.box, first.sure)


class Follower:
    """Detector of one person: looks where the person was, and all over the image when there was none or it is lost.

    A person much smaller than the image is overlooked in all of it, so squares as wide as its shorter side are
    searched as well, with one look each. Whoever is found has to be seen as surely by a look more.
    """

    def __init__(self, network: CropNetwork, twice: bool = False) -> None:
        """twice: whether a person who was found is looked at twice."""
        self._network, self._twice = network, twice
        self._look = partial(looked_twice, network) if twice else network.look
        self.method = f"{network.method}{', 2 looks' * twice}"
        self.layout: Layout = network.layout

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says; the first of `before` is followed."""
        for person in before[:1]:
            person_now = self._look(image, self._network.next_crop(person))
            if person_now.sure >= LOST and _middle_inside(person_now, image):
                return (person_now,)
        person_now = self._search(image)
        if person_now is None:
            return ()
        # A tree that passes for somebody in one look seldom does so in another, where the next frame looks.
        again = self._look(image, self._network.next_crop(person_now))
        if again.sure < _FOUND:
            return ()
        return (again if self._twice else person_now,)

    def _search(self, image: np.ndarray) -> Found | None:
        best = None
        for window in _windows(image):
            person = self._network.look(image, fitted(window, self._network.aspect))
            for _ in range(_CLOSER):
                if person.sure >= _HINT:
                    person = self._network.look(image, self._network.next_crop(person))
            if person.sure < _FOUND or not _middle_inside(person, image):
                continue
            # Of equals that of the larger window, which shows all of it.
            if best is None or person.sure > best.sure:
                best = person
        return best


class TopDown:
    """Detector of everybody whom a network of people finds."""

    def __init__(self, network: CropNetwork, persons: PersonNetwork, twice: bool = False) -> None:
        """twice: whether every person is looked at twice."""
        self._network, self._persons = network, persons
        self._look = partial(looked_twice, network) if twice else network.look
        self.method = f"{network.method}{', 2 looks' * twice}+{persons.method}"
        self.layout: Layout = network.layout

    def people(self, image: np.ndarray, before: Sequence[Found] = ()) -> tuple[Found, ...]:
        """As Detector says."""
        network = self._network
        crops = (fitted(box, network.aspect, network.room) for box in self._persons.boxes(image))
        everybody = (self._look(image, crop) for crop in crops)
        return tuple(person for person in everybody if person.sure >= LOST)


def _windows(image: np.ndarray) -> list[np.ndarray]:
    """Boxes (4,): the whole image; and, unless it is square, squares along its longer side that half overlap."""
    size = np.array(image.shape[1::-1], dtype=float)
    side, long = size.min(), int(size.argmax())
    windows = [np.array([0, 0, *size])]
    steps = int(np.ceil(2 * (size.max() / side - 1)))
    for start in np.linspace(0, size.max() - side, steps + 1) if steps else ():
        corner = np.zeros(2)
        corner[long] = start
        windows.append(np.concatenate([corner, corner + side]))
    return windows


def _middle_inside(person: Found, image: np.ndarray) -> bool:
    middle = (person.box[:2] + person.box[2:]) / 2
    return bool((middle >= 0).all() and (middle < image.shape[1::-1]).all())
