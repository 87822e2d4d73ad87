"""OpenSees in a process of its own."""

from tests.peers.opensees import by_opensees

__all__ = ["by_opensees"]
