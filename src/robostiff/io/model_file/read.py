"""From a file or document to a robot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from robostiff.io.document import Document, read_document
from robostiff.io.model_file.build import build_robot
from robostiff.io.model_file.build_machine import ShippedFile, no_shipped_file
from robostiff.io.model_file.symbols import Symbols
from robostiff.io.model_file.written_model import written_model

if TYPE_CHECKING:
    from robostiff.model import Robot


def read_model(
    source: Path | str,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
) -> Robot:
    """Read a robot from a model file.

    Parameters
    ----------
    source : path or str
        YAML file; ``-`` for standard input.
    parameters : mapping of str to (str or float), optional
        Other values for some of the file's parameters: quantities, expressions, or bare numbers in
        the SI unit of what they replace.
    symbols : iterable of str, or ALL_PARAMETERS
        Parameters that stay SymPy symbols of the same name; `parameters` gives their nominal
        values then.

    Returns
    -------
    Robot
        Closed at its home pose.

    Raises
    ------
    FileError
        At the place in the file that is to blame.
    InputError
        When a parameter is given that the file does not have, or of another dimension.

    See Also
    --------
    robostiff.robots.load : takes shipped robots by name, and snapshots too.
    """
    return model_from_document(read_document(source), parameters, symbols=symbols)


def model_from_document(
    document: Document,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
    shipped: ShippedFile = no_shipped_file,
) -> Robot:
    r"""The robot that a document describes.

    Parameters
    ----------
    document : Document
    parameters : mapping of str to (str or float), optional
        Other values for some of its parameters.
    symbols : iterable of str, or ALL_PARAMETERS
        Parameters that stay SymPy symbols of the same name.
    shipped : callable
        The file of a shipped robot that a module names; None for any other name.

    Raises
    ------
    FileError
        At the place in the document that is to blame.
    InputError
        When a parameter is given that the document does not have, or of another dimension.

    Examples
    --------
    >>> from robostiff.io.document import parse_document
    >>> robot = model_from_document(parse_document('''
    ... robostiff: 1
    ... name: cantilever
    ... source: an example
    ... parameters: {L: 300 mm}
    ... legs:
    ...   - name: arm
    ...     chain:
    ...       - type: beam
    ...         to: [L, 0, 0]
    ...         material: steel
    ...         section: {circle: {diameter: 20 mm}}
    ... '''), parameters={"L": "400 mm"})
    >>> robot.legs[0].chain.elements[0].to
    array([0.4, 0. , 0. ])
    """
    return build_robot(document, written_model(document), parameters or {}, symbols, shipped)
