"""The reference cases."""

from __future__ import annotations

import functools
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import robostiff as rs
from robostiff.elastostatics import CartesianStiffness, Form, aggregate, matrix_length
from robostiff.io.snapshot import read_snapshot
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
    return rs.chain_stiffness(C, J_q, form=form, length=None if in_one_point else length)


def robot_stiffness(snapshot: Snapshot, form: Form) -> CartesianStiffness:
    at = snapshot.reference_point
    return aggregate([leg_stiffness(snapshot, leg, at, form) for leg in snapshot.legs])
