"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path beside the wanted one, to write to; it takes the other's place once it is written.

    Raises
    ------
    OSError
    """
    wanted = Path(path)
    begun = wanted.with_name(f".{wanted.name}.{uuid.uuid4().hex[:8]}")
    try:
        yield begun
        begun.replace(wanted)
    finally:
        begun.unlink(missing_ok=True)
