"""The built-in walker, with its measures."""

import pytest

from golden.walks import measured
from pcnet3d.examples.walker.walk import walker


@pytest.fixture(scope="module")
def walk():
    return walker(seconds=12)


@pytest.fixture(scope="module")
def take(walk):
    return measured(walk.poses)
