"""The program's version and its sources, in a file that everything may read."""

import hashlib
from collections.abc import Iterable
from pathlib import Path

__version__ = "0.1.0"


def digest(names: Iterable[str], package: Path = Path(__file__).parent) -> str:
    """Hash of the source files of these names, and of all below folders of these names."""
    found = hashlib.sha256()
    for source in sorted(path for name in names for path in (package / name, *(package / name).rglob("*.py")) if path.is_file()):
        found.update(f"{source.relative_to(package)}\0".encode())
        found.update(source.read_bytes())
    return found.hexdigest()
