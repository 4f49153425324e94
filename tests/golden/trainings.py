"""The config of a training as small as it gets."""

from pathlib import Path

TINY = Path(__file__).with_name("tiny.toml").read_text(encoding="utf-8")


def tiny(*changes: tuple[str, str]) -> str:
    """tiny.toml with pieces of its text replaced: (before, after) each."""
    text = TINY
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after)
    return text
