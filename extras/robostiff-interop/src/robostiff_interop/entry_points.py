"""What robostiff finds here: readers and writers, whose modules are imported when they are used."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import robostiff_interop
from robostiff.extras import Writer
from robostiff.io.rigid_tree import Reader

if TYPE_CHECKING:
    from robostiff.io.rigid_tree import RigidTree
    from robostiff.network import Network


def _of_file(path: Any) -> RigidTree:
    return robostiff_interop.read_mjcf(path)


def _of_mujoco(model: Any) -> RigidTree:
    return robostiff_interop.tree_of_mujoco(model)


def _of_pinocchio(model: Any) -> RigidTree:
    return robostiff_interop.tree_of_pinocchio(model)


def _for_opensees(network: Network, ending: str) -> str:
    return robostiff_interop.opensees_script(network, in_python=ending == ".py")


def _for_calculix(network: Network, _: str) -> str:
    return robostiff_interop.calculix_input(network)


MJCF = Reader("an MJCF file", _of_file)
MUJOCO = Reader("a model of MuJoCo", _of_mujoco)
PINOCCHIO = Reader("a model of Pinocchio", _of_pinocchio)
OPENSEES = Writer((".tcl", ".py"), _for_opensees)
CALCULIX = Writer((".inp",), _for_calculix)
