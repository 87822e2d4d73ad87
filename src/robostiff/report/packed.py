"""Text packed into a page: compressed, in characters that HTML leaves as they are."""

from __future__ import annotations

import gzip
from base64 import b85decode, b85encode

# RFC 1924, with a full stop in place of the one character that could begin a tag
_HTML = bytes.maketrans(b"<", b".")
_BACK = bytes.maketrans(b".", b"<")


def packed(text: str) -> str:
    """Text as the script of the page unpacks it; the same for the same text.

    Examples
    --------
    >>> unpacked(packed("stiff " * 1000)) == "stiff " * 1000
    True
    """
    compressed = gzip.compress(text.encode(), 9, mtime=0)
    return b85encode(compressed).translate(_HTML).decode("ascii")


def unpacked(written: str) -> str:
    """The text that was packed."""
    return gzip.decompress(b85decode(written.encode("ascii").translate(_BACK))).decode()
