"""The reference cases, and the same in millimetres."""

from __future__ import annotations

import copy
import functools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.elastostatics import (
    CartesianStiffness,
    Form,
    aggregate,
    chain_stiffness,
    matrix_length,
)
from robostiff.io.document import parse_document
from robostiff.io.snapshot import read_snapshot, snapshot_from_document
from robostiff.kinematics import leg_compliance, passive_jacobian
from robostiff.model import PlacedLeg, Snapshot

DATA = Path(__file__).parent / "data"
NAMES = sorted(path.stem for path in DATA.glob("*.json"))


@dataclass(frozen=True)
class Case:
    """A robot at a pose, and what its stiffness is."""

    name: str
    data: dict[str, Any]
    snapshot: Snapshot

    @property
    def oracle(self) -> dict[str, Any]:
        return self.data["oracle"]

    @property
    def K(self) -> np.ndarray:
        return np.array(self.oracle["K"])

    @property
    def size(self) -> float:
        """Size of the robot for the metric [m]."""
        points = [leg.end for leg in self.snapshot.legs] + [np.zeros(3)]
        points += [element.point for leg in self.snapshot.legs for element in leg.parts]
        return float(np.ptp(points, axis=0).max())


@functools.cache
def case(name: str) -> Case:
    path = DATA / f"{name}.json"
    return Case(name, json.loads(path.read_text()), read_snapshot(path))


def leg_stiffness(
    snapshot: Snapshot, leg: PlacedLeg, at: np.ndarray, form: Form
) -> CartesianStiffness:
    rows = list(snapshot.space.rows)
    J_q, _ = passive_jacobian(leg, at)
    C, J_q = leg_compliance(leg, at)[np.ix_(rows, rows)], J_q[rows]
    length = float(snapshot.characteristic_length)
    in_one_point = length < 1e-6 * matrix_length(C, J_q)  # then it follows from the springs
    return chain_stiffness(C, J_q, form=form, length=None if in_one_point else length)


def robot_stiffness(snapshot: Snapshot, form: Form) -> CartesianStiffness:
    at = snapshot.reference_point
    return aggregate([leg_stiffness(snapshot, leg, at, form) for leg in snapshot.legs])


@functools.cache
def in_millimetres(name: str) -> Snapshot:
    """The same robot with every length in millimetres, forces in newtons."""
    data = copy.deepcopy(case(name).data)
    data["reference_point"] = _scaled(data["reference_point"], 1e3)
    for leg in data["legs"]:
        leg["end"] = _scaled(leg["end"], 1e3)
        for element in leg["chain"]:
            _to_millimetres(element)
    return snapshot_from_document(parse_document(json.dumps(data), file=f"{name}.json"))


def in_metres(K_mm: np.ndarray) -> np.ndarray:
    """A stiffness matrix [N/mm, N, N mm] as [N/m, N, N m]."""
    translations = {6: 3, 3: 2}[len(K_mm)]
    factor = np.where(np.arange(len(K_mm)) < translations, 1e3, 1.0)
    return K_mm * np.outer(factor, factor) / 1e3


def _to_millimetres(element: dict[str, Any]) -> None:
    for key in ("point", "start", "end"):
        if key in element:
            element[key] = _scaled(element[key], 1e3)
    for key, factor in {"E": 1e-6, "G": 1e-6, "A": 1e6, "Iy": 1e12, "Iz": 1e12, "J": 1e12}.items():
        if key in element:
            element[key] *= factor
    if "k" in element:
        element["k"] *= 1e-3 if element["kind"] == "P" else 1e3
    if "K" in element:
        root = np.repeat([1e-3, 1e3], 3) ** 0.5
        element["K"] = (np.array(element["K"]) * np.outer(root, root)).tolist()


def _scaled(vector: list[float], factor: float) -> list[float]:
    return [factor * x for x in vector]
