"""Checksums of files."""

from hashlib import sha256
from pathlib import Path


def digest(path: Path) -> str:
    """SHA-256 of the content of a file."""
    with path.open("rb") as file:
        content = sha256()
        while block := file.read(1 << 20):
            content.update(block)
    return content.hexdigest()
