"""What tests expect of input that cannot be used."""

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from pcnet3d.pipeline.core.errors import InputError


@contextmanager
def refused(code: str | None, *quoted: object) -> Iterator[None]:
    """Passes where an InputError of that code (None: of any) is raised, whose message has all of `quoted`, such as the
    values that came, whatever else it says."""
    with pytest.raises(InputError) as raised:
        yield
    assert code in (None, raised.value.code), raised.value
    for value in quoted:
        assert str(value) in str(raised.value)
