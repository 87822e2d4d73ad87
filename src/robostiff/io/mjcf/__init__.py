"""MJCF: robot descriptions of MuJoCo, read by MuJoCo."""

from robostiff.io.mjcf.tree_of_model import read_mjcf, tree_of_mujoco

__all__ = ["read_mjcf", "tree_of_mujoco"]
