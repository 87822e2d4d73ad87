"""Models of Pinocchio as trees of rigid links."""

from robostiff.io.pinocchio.read import tree_of_pinocchio

__all__ = ["tree_of_pinocchio"]
