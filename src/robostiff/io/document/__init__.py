"""YAML and JSON files as plain data, with the location of every value."""

from robostiff.io.document.document import Document, DocumentPlace, Limits
from robostiff.io.document.read import parse_document, read_document

__all__ = ["Document", "DocumentPlace", "Limits", "parse_document", "read_document"]
