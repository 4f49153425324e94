"""Where a video goes on with another scene."""

import numpy as np
import pytest

from pcnet3d.models.detector.scene_cuts import Glance


@pytest.mark.parametrize("frames", [1, 3])
def test_cuts_and_what_is_none(toys, frames):
    here, moved = toys.scene((50, 50, 80, 150)), toys.scene((52 + frames, 50, 82 + frames, 150))
    other = toys.scene((50, 50, 80, 150), seed=3)
    a, b, c = Glance.at(here), Glance.at(moved), Glance.at(other)
    assert not a.is_cut_to(b)
    assert a.is_cut_to(c)
    assert not a.is_cut_to(Glance.at((here // 2 + 40).astype(np.uint8)))  # another exposure
    black = Glance.at(np.zeros_like(here))
    assert not a.is_cut_to(black)
    assert not black.shows
    assert a.shows


def test_somebody_who_comes_near_while_images_are_missing_is_in_the_same_room(toys):
    """A dark person over two fifths of the image."""
    here = toys.scene((50, 50, 80, 150))
    near = here.copy()
    near[:, : int(0.4 * here.shape[1])] = 10
    assert not Glance.at(here).is_cut_to(Glance.at(near))
