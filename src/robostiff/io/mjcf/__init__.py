"""MJCF: robot descriptions of MuJoCo, read by MuJoCo."""

from robostiff.io.mjcf.read import read_mjcf

__all__ = ["read_mjcf"]
