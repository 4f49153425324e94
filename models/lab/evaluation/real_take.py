"""Runs on real videos with truth:  pcnet3d lab evaluate real-take -o DIR

A man who balances, seen by four calibrated cameras that stand still and lean: his limbs are known from all of them
together (triangulated), and so is which way is up. Every camera is run by itself, focal length unknown, by the
skeletons alone and with the image; mean: over cameras. Then the same man standing still, where only up is known.

up_deg: how far up is off, stated_deg: the root mean square error stated of it; levelled: takes that are not refused.
rigid_mm: mean distance of the 12 limb joints from the true ones, from the mid-hips, after one rotation and scale for
the take. rmse, mae: of angles, degrees, of takes that are levelled.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain

import numpy as np

from ....pipeline.core.layouts import H36M17, LIMBS
from ....pipeline.core.rotations import angle_deg, kabsch, rotate
from ...common.metrics import joint_error, relative
from ..beds import BALANCING, STANDING, Configuration, Finished, finished
from ..cases import Row, mean, scaled
from .errors import of_frames, together

_TAKES = {"balancing": BALANCING, "standing": STANDING}
_IMAGE = {"skeletons alone": False, "with its image": True}
_ANGLES = ("knee_flexion", "elbow_flexion", "trunk_lean_sagittal", "trunk_lean_frontal")
_LIMB_ROWS = H36M17.indices(LIMBS)


def rows(asked: Configuration) -> Iterator[Row]:
    """("balancing" or "standing", "skeletons alone" or "with its image", camera, and `row`), and "mean", of all
    cameras. InputError where the data is not."""
    for take, name in _TAKES.items():
        for how, image in _IMAGE.items():
            of_each = {
                run.truth.clip: [*row(run)] for run in finished(replace(asked, image=image, real=name))
            }
            of_each["mean"] = [*chain.from_iterable(of_each.values())]
            for camera, figures in of_each.items():
                yield from (((take, how, camera, *keys), value) for keys, value in figures)


def row(run: Finished) -> Iterator[Row]:
    """One camera's figures, NaN without an answer."""
    levelled, up, stated = 0.0, np.nan, np.nan
    if run.take is not None:
        rectified = run.take.need("rectified")
        levelled, stated = float(rectified.level_ok), mean(rectified.up_error_deg)
        up = float(angle_deg(rectified.R_source_from_level[..., 2], run.truth.up).mean())
    yield ("levelled",), levelled
    yield ("up_deg",), up
    yield ("stated_deg",), stated
    if np.isfinite(run.truth.truth[:, _LIMB_ROWS]).all():
        yield ("rigid_mm",), np.nan if run.take is None else rigid_mm(run)
        found = together(of_frames(run))
        for angle in _ANGLES:
            error = found[angle]["error"] if angle in found else np.zeros(0)
            yield (angle, "rmse"), mean(error**2) ** 0.5
            yield (angle, "mae"), mean(np.abs(error))


def rigid_mm(run: Finished) -> float:
    """Mean distance of the limbs' joints, both bodies relative to the mid-hips, after the best rotation and scale for
    the take, whichever way is up."""
    found, true = (
        relative(joints.astype(np.float64))[:, _LIMB_ROWS]
        for joints in (run.done.need("poses").joints, run.truth.truth[run.rows])
    )
    R_true_from_found = kabsch(true.reshape(-1, 3), found.reshape(-1, 3))
    return mean(1000 * joint_error(scaled(rotate(R_true_from_found, found), true, "take"), true))


def summary(values: list[float]) -> float:
    """Their mean."""
    return mean(np.array(values))
