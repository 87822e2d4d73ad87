"""A snapshot as the data of a snapshot file."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from robostiff.elasticity import Elasticity, elasticity_from_stiffness
from robostiff.elastostatics import chain_stiffness
from robostiff.errors import InputError, NoAnswerError
from robostiff.model import (
    PlacedBlock,
    PlacedElement,
    PlacedFreedom,
    PlacedLeg,
    PlacedSpring,
    Snapshot,
)
from robostiff.spatial import Space

# Part of its size by which a compliance may change when it is written as a stiffness.
_READS_BACK = 1e-12


def snapshot_to_data(snapshot: Snapshot) -> dict[str, Any]:
    """Plain data that `read_snapshot` reads back, once written as JSON.

    Every elastic part becomes a ``spring6`` with its stiffness, or with its compliance if that is
    singular; rigid joints are left out, for whatever lies between elements is rigid.

    Parameters
    ----------
    snapshot : Snapshot
        At one pose.

    Returns
    -------
    dict

    Raises
    ------
    InputError
        When it holds several poses, or something that the format cannot tell.

    Examples
    --------
    >>> from robostiff.model import Actuated, Motion
    >>> drive = PlacedFreedom("drive", Motion.TRANSLATION, np.zeros(3), np.eye(3)[2], Actuated(2e6))
    >>> jack = Snapshot("jack", (PlacedLeg("leg", (drive,), np.zeros(3)),), np.zeros(3))
    >>> data = snapshot_to_data(jack)
    >>> data["legs"][0]["chain"][0]["k"]
    2000000.0
    """
    if snapshot.platform is not None:
        raise InputError(
            f"snapshot {snapshot.name!r} as a file of legs",
            got="a flexible platform",
            expected="a rigid one",
            hint="write it as a graph: network_to_data(network_of_snapshot(snapshot))",
        )
    data: dict[str, Any] = {"name": snapshot.name or "robot"}
    if snapshot.description:
        data["description"] = snapshot.description
    data["units"] = "SI: m, N, rad"
    if snapshot.space is Space.PLANAR:
        data["planar"] = True
    data["reference_point"] = _one_pose(snapshot.reference_point, 1)
    names = distinct(leg.name for leg in snapshot.legs)
    data["legs"] = [_leg(leg, name) for leg, name in zip(snapshot.legs, names, strict=True)]
    return data


def _leg(leg: PlacedLeg, name: str) -> dict[str, Any]:
    if not any(isinstance(e, PlacedSpring) or e.stiffness is not None for e in leg.parts):
        raise InputError(
            f"leg {name} without compliance",
            expected="at least one elastic part or joint",
            hint="give a link or an actuator of the leg its elasticity",
        )
    return _chain(leg, name, "")


def _chain(leg: PlacedLeg, name: str, prefix: str) -> dict[str, Any]:
    """A leg or a branch; names lose the ``block/branch/`` that the reader puts before them."""
    elements = [e for e in leg.elements if not _is_rigid(e)]
    names = distinct(e.name.removeprefix(prefix) for e in elements)
    chain = [
        _block(e, n) if isinstance(e, PlacedBlock) else _element(e, n)
        for e, n in zip(elements, names, strict=True)
    ]
    return {"name": name, "end": _one_pose(leg.end, 1), "chain": chain}


def _block(block: PlacedBlock, name: str) -> dict[str, Any]:
    own = f"{block.name}/"
    names = distinct(branch.name.removeprefix(own) for branch in block.branches)
    branches = [
        _chain(branch, n, f"{branch.name}/")
        for branch, n in zip(block.branches, names, strict=True)
    ]
    return {"type": "parallel", "name": name, "branches": branches}


def _is_rigid(element: PlacedElement) -> bool:
    return (
        isinstance(element, PlacedFreedom) and not element.is_passive and element.stiffness is None
    )


def _element(element: PlacedFreedom | PlacedSpring, name: str) -> dict[str, Any]:
    if isinstance(element, PlacedSpring):
        return {
            "type": "spring6",
            "name": name,
            "point": _one_pose(element.point, 1),
            "rotation": _one_pose(element.rotation, 2),
            **matrix_data(element.elasticity, name),
        }
    data = {
        "type": "passive" if element.is_passive else "spring",
        "name": name,
        "kind": element.motion.value,
        "point": _one_pose(element.point, 1),
        "axis": _one_pose(element.axis, 1),
    }
    return data if element.is_passive else {**data, "k": element.stiffness}


def matrix_data(elasticity: Elasticity, name: str) -> dict[str, Any]:
    """The stiffness of a spring if it says all there is to say, else its compliance."""
    compliance = _one_pose(elasticity.compliance, 2)
    K = _stiffness(np.array(compliance), elasticity.freedoms)
    if K is not None:
        return {"K": K.tolist()}
    if elasticity.freedoms.size:
        raise InputError(
            f"spring {name} with directions both free and rigid",
            expected="a spring that is given by one matrix",
            hint="write its free directions as passive joints beside it",
        )
    return {"compliance": compliance}


def _stiffness(C: np.ndarray, freedoms: np.ndarray) -> np.ndarray | None:
    """Stiffness from which the compliance and the freedoms are found again; None without one."""
    try:
        K = chain_stiffness(C, freedoms).K
        back = elasticity_from_stiffness(K)
    except (NoAnswerError, InputError):
        return None
    if freedoms.size:
        return K if back.freedoms.shape == freedoms.shape else None
    size = np.sqrt(np.diagonal(C))
    same = np.all(np.abs(back.compliance - C) <= _READS_BACK * np.outer(size, size))
    return K if same else None


def _one_pose(array: np.ndarray, axes: int) -> list[Any]:
    """The array as lists, without batch axes."""
    value = np.asarray(array, dtype=float)
    shape = value.shape[value.ndim - axes :]
    if value.size != np.prod(shape):
        raise InputError(
            "shape of the batch of poses",
            got=value.shape[: value.ndim - axes],
            expected="one pose",
            hint="a snapshot file holds one pose: write a file for each",
        )
    return value.reshape(shape).tolist()


def distinct(names: Iterable[str]) -> list[str]:
    """The names, with a number behind those that are taken already."""
    unique: list[str] = []
    for name in names:
        candidate, number = name or "part", 2
        while candidate in unique:
            candidate, number = f"{name or 'part'} ({number})", number + 1
        unique.append(candidate)
    return unique
