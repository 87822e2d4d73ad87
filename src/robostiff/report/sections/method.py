"""How the numbers were computed, so that somebody can compute them again."""

from __future__ import annotations

import platform
from importlib.metadata import version

from robostiff.markup import Facts, row
from robostiff.report.contents import ReportContents
from robostiff.report.section import Section, section
from robostiff.version import __version__

_PACKAGES = ("numpy", "scipy", "sympy")


def method_section(contents: ReportContents) -> Section:
    """Method, point, conventions and versions."""
    result = contents.stiffness
    pose = "its own" if result.pose is None else f"[{row(result.pose)}] (m, rad)"
    packages = ", ".join(f"{name} {version(name)}" for name in _PACKAGES)
    facts = {
        "method": f"{result.method.name}: {result.method.equation}",
        "pose": f"{pose}: x, y, z and rotation vector of the platform",
        "reference point": f"({row(result.reference_point)}) m",
        "conventions": "F = K t in world axes; twist: displacement of the reference point, then "
        "rotation; wrench: force, then moment about the reference point; SI units",
        "theory": "A. Pashkevich, A. Klimchik, S. Caro, D. Chablat: Cartesian stiffness matrix of "
        "manipulators with passive joints: analytical approach, 2011",
        "versions": f"robostiff {__version__}, Python {platform.python_version()}, {packages}",
    }
    found = contents.found
    if found is not None:
        poses = found.attrs.get("poses", "unknown")
        facts["map"] = f"{poses} poses, robostiff {found.attrs.get('robostiff_version', 'unknown')}"
    return section("method", "How it was computed", [Facts(tuple(facts.items()))])
