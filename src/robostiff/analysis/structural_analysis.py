"""The method by which networks are solved, by name."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class StructuralAnalysis:
    """Matrix structural analysis: all bodies and all wrenches between them in one system."""

    name = "network"
    equation = "[[0, A^T], [A, -S]] [x; f] = [F; 0], condensed to the platform"
