"""Where the pelvis is over time, and the errors of points, as covariances, through changes of axes and unit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from .errors import InputError
from .rotations import rotate


@dataclass(frozen=True, eq=False)
class RootPath:
    """Where the pelvis of joints relative to it is, in their axes and unit, from a point that does not move: the
    camera, the world's origin.

    points: (T, D) float64, NaN where missing.
    covariance: (T, D, D) float64 of the error of a path that was estimated (stages.place), NaN where it is missing;
        None where the source itself knows the place.
    shared: the part of an estimated path's error that all frames share: standard deviations of the body's size and of
        the focal length, as shares of them; None where the source knows the place.
    """

    points: np.ndarray
    covariance: np.ndarray | None = None
    shared: tuple[float, float] | None = None

    @property
    def sd(self) -> np.ndarray | None:
        """(T, D) standard deviation of the error along each axis; None where no error is stated."""
        covariance = self.covariance
        return None if covariance is None else np.sqrt(np.diagonal(covariance, axis1=1, axis2=2))

    def each(self, function: Callable[[np.ndarray], np.ndarray]) -> RootPath:
        """A copy with the function's answer for each array that has a row a frame."""
        covariance = None if self.covariance is None else function(self.covariance)
        return replace(self, points=function(self.points), covariance=covariance)

    def moved(self, A: np.ndarray) -> RootPath:
        """A copy for the axes and unit of points A x, A (D, D)."""
        return replace(self, points=rotate(A, self.points), covariance=moved_covariance(self.covariance, A))

    def owned(self, rows: int, dims: int) -> RootPath:
        """Of arrays that nobody can change. InputError where they are not of so many rows and coordinates."""
        path = self.each(lambda values: owned(values, np.float64))
        check_shape("path", path.points, (rows, dims), finite=True)
        check_shape("the path's covariance", path.covariance, (rows, dims, dims))
        return path


def moved_covariance(covariance: np.ndarray | None, A: np.ndarray) -> np.ndarray | None:
    """A C A^T of covariances C (T, D, D) or (T, J, D, D), for A (D, D) or (T, D, D), one a frame, in their own
    precision; None stays None."""
    if covariance is None:
        return None
    A = np.asarray(A, dtype=covariance.dtype)
    A = A[:, None] if A.ndim == 3 and covariance.ndim == 4 else A
    return A @ covariance @ np.swapaxes(A, -1, -2)


def owned(values: Any, dtype: type) -> np.ndarray:
    """The values (T, ...) as an array that nobody can change: itself if it is so already, else a copy."""
    array = np.asarray(values, dtype=dtype)
    if array.base is not None or (array is values and array.flags.writeable):
        array = array.copy()
    array.setflags(write=False)
    return array


def check_shape(name: str, array: np.ndarray | None, shape: tuple[int, ...], finite: bool = False) -> None:
    """InputError for an array that is not of this shape (T, ...), or has infinite values where they are refused."""
    if array is not None and (array.shape != shape or (finite and np.isinf(array).any())):
        what = f"Expected {name} of shape {shape}{', finite or NaN' * finite}"
        raise InputError("wrong-content", f"{what}, got {array.shape}.")
