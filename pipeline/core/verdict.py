"""How far poses can be trusted: findings, and the word for the gravest of them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

Weight = Literal["note", "suspicious", "unusable"]


@dataclass(frozen=True)
class Finding:
    """One thing to know of a take. name: a short word for programs; text: a sentence with its evidence."""

    weight: Weight
    name: str
    text: str


def verdict(findings: Iterable[Finding]) -> str:
    """The gravest finding: "good", "suspicious" or "unusable"."""
    weights = {finding.weight for finding in findings}
    return next((weight for weight in ("unusable", "suspicious") if weight in weights), "good")


def verdict_words(findings: Iterable[Finding]) -> str:
    """The verdict and what it rests on, in a sentence."""
    findings = tuple(findings)
    grave = [finding.text.rstrip(".") for finding in findings if finding.weight != "note"]
    return f"the poses are {verdict(findings)}{': ' if grave else ''}{'; '.join(grave)}"
