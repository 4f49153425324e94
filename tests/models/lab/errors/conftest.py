"""Reports that are written in tests."""

import pytest

from pcnet3d.models.lab.evaluation import ledger


@pytest.fixture(autouse=True)
def no_ledger_of_the_repository(monkeypatch, tmp_path):
    """Looks at test sets that tests make up are written beside their reports."""
    monkeypatch.setattr(ledger, "ROOT", tmp_path / "installed")
