"""What tests expect of input that cannot be used."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from pcnet3d.pipeline.core.errors import InputError
from pcnet3d.pipeline.core.refusals import Refusal


@contextmanager
def refused(code: Refusal, *quoted: object) -> Iterator[None]:
    """Passes where an InputError of that code is raised, whose message has all of `quoted`, such as the values that
    came, whatever else it says."""
    with pytest.raises(InputError) as raised:
        yield
    assert raised.value.code == code, raised.value
    for value in quoted:
        assert str(value) in str(raised.value)
