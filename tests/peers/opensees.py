"""Stiffness of a network by OpenSees, from the commands of its input file."""

from __future__ import annotations

import ast
import ctypes
import os
import runpy
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import redirect_stdout
from functools import partial
from importlib.metadata import PackageNotFoundError, files
from io import StringIO
from itertools import pairwise, product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from robostiff.network import Network
from robostiff_interop import opensees_commands

# Springs for rigid joints, in units of the stiffest part; each a tenth of the one before.
STIFFEST = 1e3
LEVELS = 4


def opensees() -> Any:
    """The module of OpenSees, with the BLAS of its wheel where the system has none."""
    try:
        parts = files("openseespylinux") or []
    except PackageNotFoundError:
        parts = []
    for part in parts:
        if part.name == "libblas.so.3":
            ctypes.CDLL(str(part.locate()), mode=ctypes.RTLD_GLOBAL)
    try:
        import openseespy.opensees as module
    except (ImportError, RuntimeError) as error:  # its own way to miss a library of the system
        raise ImportError(str(error)) from error
    return module


def load_opensees() -> None:
    """Raise an ImportError where OpenSees is missing."""
    opensees()


def silence() -> None:
    """Let this process write nothing, however low the level at which it does."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)


@pytest.fixture(scope="module")
def by_opensees() -> Iterator[Callable[..., Any]]:
    """OpenSees in a process of its own, where nobody reads what it prints as it ends."""
    with ProcessPoolExecutor(1, get_context("spawn"), initializer=silence) as process:
        try:
            process.submit(load_opensees).result()
        except ImportError as error:
            pytest.skip(f"OpenSees cannot be loaded here: {error}")
        yield lambda by, *given: process.submit(by, *given).result()


def stiffness_by_opensees(network: Network) -> np.ndarray:
    """Stiffness about the reference point, the inverse of deflections under unit loads (n, n)."""
    return np.linalg.inv(_extrapolated(partial(_compliance, network)))


def bodies_in_opensees(network: Network) -> dict[str, np.ndarray]:
    """Where the nodes of OpenSees that stand for bodies are [m]."""
    nodes = [
        command.arguments[1:] for command in opensees_commands(network) if command.name == "node"
    ]
    return {body.name: np.array(at, float) for body, at in zip(network.nodes, nodes, strict=False)}


def frequencies_by_opensees(network: Network, masses: Mapping[str, float]) -> np.ndarray:
    """Natural frequencies of points of mass at nodes, fastest last [Hz].

    OpenSees finds how the points move under unit forces; ``F M`` has the eigenvalues 1/omega^2.
    """
    rows = [row for row in network.space.rows if row < 3]
    F = _extrapolated(partial(_flexibility, network, tuple(masses), rows))
    roots = np.sqrt(np.repeat(list(masses.values()), len(rows)))
    squares = np.linalg.eigvalsh(roots[:, None] * F * roots)[::-1]
    moving = squares > 1e-9 * squares[0]
    return 1 / np.sqrt(squares[moving]) / (2 * np.pi)


def _extrapolated(compliance: Callable[[float], np.ndarray]) -> np.ndarray:
    """Compliance with rigid joints, from those with springs in their place.

    It is a power series in 1 / stiffness of the springs, of which Richardson's extrapolation takes
    away the first terms.
    """
    table = [compliance(STIFFEST / 10.0**i) for i in reversed(range(LEVELS))]
    for order in range(1, LEVELS):
        factor = 10.0**order
        table = [(factor * fine - coarse) / (factor - 1) for coarse, fine in pairwise(table)]
    return table[0]


def _compliance(network: Network, stiff: float) -> np.ndarray:
    """Twists of the reference point under unit loads (n, n)."""
    ops, twists = opensees(), []
    ops.wipe()
    for command in opensees_commands(network, stiff):
        answer = getattr(ops, command.name)(*command.arguments)
        if command.name == "analyze" and answer != 0:
            raise ArithmeticError("OpenSees found no equilibrium")
        if command.printed:
            twists.append(np.array(answer)[list(network.space.rows)])
    C = np.array(twists).T
    return 0.5 * (C + C.T)


def _flexibility(
    network: Network, nodes: Sequence[str], rows: Sequence[int], stiff: float
) -> np.ndarray:
    """Displacements of nodes under unit forces on them (m, m)."""
    _compliance(network, stiff)  # builds the network, which is then without load
    ops, moved = opensees(), []
    tags = [1 + [node.name for node in network.nodes].index(name) for name in nodes]
    for tag, row in product(tags, rows):
        ops.pattern("Plain", 1, 1)
        ops.load(tag, *np.eye(6)[row].tolist())
        if ops.analyze(1) != 0:
            raise ArithmeticError("OpenSees found no equilibrium")
        moved.append([ops.nodeDisp(own)[i] for own, i in product(tags, rows)])
        ops.remove("loadPattern", 1)
    F = np.array(moved)
    return 0.5 * (F + F.T)


def columns_of_script(path: Path) -> np.ndarray:
    """What an input file prints, run by OpenSees: a column a line, in Tcl or Python."""
    ops, printed = opensees(), []
    ops.wipe()
    if path.suffix == ".py":
        with redirect_stdout(StringIO()) as shown:
            runpy.run_path(str(path))
        printed = [ast.literal_eval(line) for line in shown.getvalue().splitlines()]
    else:
        from tkinter import Tcl

        interpreter = Tcl()

        def run(name: str, *arguments: str) -> Any:
            if name == "pattern":
                ops.pattern(*map(_value, arguments[:-1]))
                return interpreter.eval(arguments[-1])
            return getattr(ops, name)(*map(_value, arguments)) or ""

        names = {line.split()[0] for line in path.read_text().splitlines() if line[0] not in "#p}"}
        for name in {*names, "pattern", "nodeDisp"}:
            interpreter.createcommand(name, partial(run, name))
        interpreter.createcommand("puts", printed.append)
        interpreter.eval(path.read_text())
        printed = [[float(x) for x in str(line).split()] for line in printed]
    return np.array(printed).T


def _value(word: str) -> str | int | float:
    """A word of Tcl as the value that it means."""
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            pass
    return word


def loaded_frame(network: Network, q: np.ndarray, foot: str, t: np.ndarray) -> dict[str, Any]:
    """Twists of nodes of a frame, all beams of which carry q (3,) in their axes; a foot settles."""
    ops = opensees()
    ops.wipe()
    ops.model("basic", "-ndm", 3, "-ndf", 6)
    tags = {node.name: i + 1 for i, node in enumerate(network.nodes)}
    for node in network.nodes:
        ops.node(tags[node.name], *map(float, node.point))
        if node.name in network.fixed and node.name != foot:
            ops.fix(tags[node.name], *[1] * 6)
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    for i, value in enumerate(t.tolist(), start=1):
        ops.sp(tags[foot], i, value)
    for k, beam in enumerate(network.beams, start=1):
        C, L = beam.tip_compliance, beam.length
        EA, GJ, EIy, EIz = (L / float(C[i, i]) for i in (0, 3, 4, 5))
        ops.geomTransf("Linear", k, *beam.rotation[:, 2].tolist())
        ends = tags[beam.a], tags[beam.b]
        ops.element("elasticBeamColumn", k, *ends, EA, 1.0, 1.0, GJ, EIy, EIz, k)
        ops.eleLoad("-ele", k, "-type", "-beamUniform", *map(float, (q[1], q[2], q[0])))
    ops.constraints("Transformation")
    ops.numberer("Plain")
    ops.system("UmfPack")
    ops.integrator("LoadControl", 1.0)
    ops.algorithm("Linear")
    ops.analysis("Static", "-noWarnings")
    if ops.analyze(1) != 0:
        raise ArithmeticError("OpenSees found no equilibrium")
    return {name: np.array(ops.nodeDisp(tag)) for name, tag in tags.items()}
