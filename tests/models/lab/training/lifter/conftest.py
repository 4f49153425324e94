"""People who hardly move, to train on."""

import pytest

from golden.trainings import three_people


@pytest.fixture
def clips():
    return three_people()
