from robostiff_interop.calculix import calculix_input
from robostiff_interop.mjcf import read_mjcf, tree_of_mujoco
from robostiff_interop.opensees import OpenSeesCommand, opensees_commands, opensees_script
from robostiff_interop.pinocchio import tree_of_pinocchio

__all__ = [
    "OpenSeesCommand",
    "calculix_input",
    "opensees_commands",
    "opensees_script",
    "read_mjcf",
    "tree_of_mujoco",
    "tree_of_pinocchio",
]
