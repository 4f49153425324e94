"""The configs of trainings as small as they get: of the rectifier and of the lifter."""

from pathlib import Path

TINY = Path(__file__).with_name("tiny.toml").read_text(encoding="utf-8")
LIFTER = Path(__file__).with_name("tiny_lifter.toml").read_text(encoding="utf-8")


def tiny(*changes: tuple[str, str], text: str = TINY) -> str:
    """tiny.toml, or another text, with pieces of it replaced: (before, after) each."""
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after)
    return text
