"""Cartesian stiffness of robots with elastic links, elastic actuators and passive joints."""

__version__ = "0.1.0"
