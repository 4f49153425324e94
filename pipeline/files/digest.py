"""What a file holds, by hash."""

from __future__ import annotations

import hashlib
from pathlib import Path


def sha256(path: Path) -> str:
    """SHA-256 of a file, or of a folder's relative names and contents in sorted order, the same on every system."""
    if path.is_file():
        with open(path, "rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    digest = hashlib.sha256()
    parts = {part.relative_to(path).as_posix(): part for part in path.rglob("*") if part.is_file()}
    for name in sorted(parts):
        digest.update(f"{name}\0{sha256(parts[name])}\n".encode(errors="replace"))
    return digest.hexdigest()
