"""What robostiff finds here: readers and writers, whose modules are imported when they are used."""
# ruff: noqa: PLW0108 - a lambda finds its function at its call

from __future__ import annotations

import robostiff_interop
from robostiff.extras import Writer
from robostiff.io.rigid_tree import Reader

MJCF = Reader("an MJCF file", lambda path: robostiff_interop.read_mjcf(path))
MUJOCO = Reader("a model of MuJoCo", lambda model: robostiff_interop.tree_of_mujoco(model))
PINOCCHIO = Reader("a model of Pinocchio", lambda model: robostiff_interop.tree_of_pinocchio(model))
OPENSEES = Writer(
    (".tcl", ".py"),
    lambda network, end: robostiff_interop.opensees_script(network, in_python=end == ".py"),
)
CALCULIX = Writer((".inp",), lambda network, _: robostiff_interop.calculix_input(network))
