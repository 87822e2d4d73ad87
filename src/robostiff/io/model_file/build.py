"""From a model file or document to a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from robostiff.errors import FileError
from robostiff.io.document import Document, read_document
from robostiff.io.expression import Mathematics, exact_mathematics
from robostiff.io.model_file.machine import ModuleFiles, ShippedFile, WrittenMachine
from robostiff.io.model_file.parts import check_version
from robostiff.io.model_file.place import Place, top_place
from robostiff.io.model_file.robots import WrittenArm, WrittenRobot
from robostiff.io.model_file.symbols import (
    ParameterChoice,
    Symbols,
    chosen_parameters,
    completed,
    meaning_of,
    symbolic_values,
)
from robostiff.io.suggest import Words
from robostiff.io.validation import validate
from robostiff.model import Robot

WrittenModel = WrittenRobot | WrittenArm | WrittenMachine

#: What describes a robot, the key that shows it, and what to write instead of two of them.
_KINDS = {
    "dh": (
        WrittenArm,
        "a table describes a serial arm as a whole; write its elements as a leg to add elastic "
        "links",
    ),
    "modules": (WrittenMachine, "legs beside other modules are a module of their own"),
}


def written_model(document: Document) -> WrittenModel:
    """A model file as it is written: a robot of legs, an arm by its table, or a hybrid machine."""
    check_version(document)
    for key, (kind, hint) in _KINDS.items():
        if key in document.data:
            if "legs" in document.data:
                raise FileError(
                    document.key_location(("legs",)),
                    "legs",
                    got=Words(f"legs beside {key}"),
                    expected="one of them",
                    hint=hint,
                )
            return validate(kind, document)
    return validate(WrittenRobot, document)


def read_model(
    source: Path | str,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
) -> Robot:
    """A robot from a model file, ``-`` for standard input, as `model_from_document` makes it.

    `robostiff.load` takes shipped robots by name, and snapshots too.
    """
    return model_from_document(read_document(source), parameters, symbols=symbols)


def model_from_document(
    document: Document,
    parameters: Mapping[str, str | float] | None = None,
    *,
    symbols: Symbols = (),
    shipped: ShippedFile = lambda _: None,
) -> Robot:
    r"""The robot that a document describes.

    Parameters
    ----------
    document : Document
    parameters : mapping of str to (str or float), optional
        Other values for some of its parameters: quantities, expressions, or bare numbers in the SI
        unit of what they replace.
    symbols : iterable of str, or ALL_PARAMETERS
        Parameters that stay SymPy symbols of the same name, or a mapping: all of them, those in it
        under shorter names; `parameters` gives their nominal values then.
    shipped : callable
        The file of a shipped robot that a module names; None for any other name.

    Raises a FileError at the place in the document that is to blame.

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
    written, overrides = written_model(document), parameters or {}
    path = Path(document.file)
    files = ModuleFiles(shipped, _robot_of, (path.resolve(),) if path.is_file() else ())
    top = top_place(document, written.parameters, overrides)
    robot = _built(written, top, files)
    names = chosen_parameters(symbols, written.parameters, overrides)
    if not names and not isinstance(symbols, ParameterChoice):
        return robot
    # Symbols stay in a robot that is built beside the one of numbers, which has been verified.
    quantities, nominal = symbolic_values(names, top.names)
    meanings = {symbol: meaning_of(top.names[name]) for name, symbol in names.items()}
    exact = exact_mathematics()
    top = top_place(document, written.parameters, {**overrides, **quantities}, exact)
    symbolic = _built(written, top, replace(files, nominal=nominal), robot.holds)
    return completed(symbolic, robot, nominal, meanings)


def _robot_of(
    document: Document, values: Mapping[str, Any], mathematics: Mathematics, files: ModuleFiles
) -> Robot:
    """The robot of a document with these values of its parameters, for a module."""
    written = written_model(document)
    return _built(written, top_place(document, written.parameters, values, mathematics), files)


def _built(
    written: WrittenModel, top: Place, files: ModuleFiles, holds: Sequence[str] = ()
) -> Robot:
    """The robot that is written; verified, unless it is one of formulas or a machine of modules."""
    robot, places = written.build(top, files, holds)
    if top.is_exact or not places:
        return robot
    from robostiff.io.model_file.at_home import at_home

    chosen = written.coordinates is not None
    return at_home(top, robot, places, chosen=chosen, laws=written.laws)
