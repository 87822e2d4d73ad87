"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import stat
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_LONGEST_ENDING = 20


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A path beside the wanted one, to write to; it takes the other's place once it is written.

    What is written is on disk before it takes that place; after an error nothing is left behind. A
    file that is replaced gives its permissions, and a link stays and leads to the new file.
    """
    wanted = Path(os.path.realpath(path))
    draft = wanted.with_name(f".{uuid.uuid4().hex}{wanted.suffix[:_LONGEST_ENDING]}")
    try:
        yield draft
        with draft.open("rb+") as file:
            os.fsync(file.fileno())  # a full disk may show only here
        if wanted.exists():
            draft.chmod(stat.S_IMODE(wanted.stat().st_mode))
        draft.replace(wanted)
    except OSError as error:
        if error.filename in (draft, str(draft)):  # a name that nobody gave
            error.filename = os.fspath(path)
        raise
    finally:
        with suppress(OSError):  # in a folder that cannot be written
            draft.unlink(missing_ok=True)
