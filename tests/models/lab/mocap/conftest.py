"""Small motion capture files, written here."""

import pytest

from golden.acclaim import write_still


@pytest.fixture
def acclaim(tmp_path):
    """A folder of somebody who stands still, as ASF and AMC."""
    (tmp_path / "acclaim").mkdir()
    return write_still(tmp_path / "acclaim")
