"""YAML and JSON files as plain data, with the location of every value."""

from robostiff.io.document.document import Document, Limits
from robostiff.io.document.read import parse_document, read_document

__all__ = ["Document", "Limits", "parse_document", "read_document"]
