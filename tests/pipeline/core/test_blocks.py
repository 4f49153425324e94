"""Rows some at a time."""

import numpy as np
import pytest

from pcnet3d.pipeline.core.blocks import blocks, overlapping


@pytest.mark.parametrize("rows", [0, 1, 9, 10, 11, 35])
def test_blocks_are_all_rows_once(rows):
    at = np.arange(rows)
    assert np.concatenate([at[:0], *(at[each] for each in blocks(rows, 10))]).tolist() == at.tolist()
    for kept, wide, inside in overlapping(rows, 10, 3):
        assert at[wide][inside].tolist() == at[kept].tolist()
        assert wide.start == max(kept.start - 3, 0)
        assert wide.stop == min(kept.stop + 3, rows)
