"""MJCF: robots as MuJoCo describes them, read by MuJoCo itself."""

from robostiff.io.mjcf.read import read_mjcf

__all__ = ["read_mjcf"]
