"""YAML and JSON files as plain data, with the location of every value."""

from robostiff.io.document.document import Document as Document
from robostiff.io.document.document import DocumentPlace as DocumentPlace
from robostiff.io.document.document import Limits as Limits
from robostiff.io.document.read import parse_document as parse_document
from robostiff.io.document.read import read_document as read_document
