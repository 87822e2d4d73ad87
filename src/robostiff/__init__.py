"""Cartesian stiffness of robots with elastic links, elastic actuators and passive joints.

    import robostiff as rs

    robot = rs.load("gough-stewart-b")
    result = rs.stiffness(robot, [0, 0, 0.8, 0, 0, 0])
    result.K, result.rank, result.free_motions, result.status

Names are imported when they are first used, so that the command line starts at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from robostiff.version import __version__

_HOMES = {
    "robostiff.analysis": (
        "CableResponse",
        "CableStiffness",
        "CableTensions",
        "CompiledAnswer",
        "CompiledRobot",
        "Deflection",
        "RobotStiffness",
        "cable_response",
        "cable_stiffness",
        "cable_tensions",
        "compile",
        "compliance",
        "deflection",
        "stiffness",
        "verify",
    ),
    "robostiff.analysis.indices": ("StiffnessIndices", "indices"),
    "robostiff.analysis.maps": (
        "Axis",
        "Batched",
        "Compiled",
        "Grid",
        "PoseList",
        "Quantity",
        "RandomPoses",
        "Threads",
        "stiffness_map",
    ),
    "robostiff.cables": ("CableStatus", "ClosedFormTensions", "GivenTensions", "NearestTensions"),
    "robostiff.compiled": (
        "Backend",
        "ComplianceMatrix",
        "DeflectionUnder",
        "Derivative",
        "NoMachineCodeWarning",
        "PrincipalStiffness",
        "StiffnessMatrix",
        "WorstDeflection",
    ),
    "robostiff.analytic": (
        "AtCoordinates",
        "AtHome",
        "AtSymbols",
        "Closed",
        "RobotDerivation",
        "Steps",
    ),
    "robostiff.errors": (
        "FileError",
        "InputError",
        "NoAnswerError",
        "RobostiffError",
    ),
    "robostiff.kinematics": (
        "JointCoordinates",
        "find_posture",
    ),
    "robostiff.model": (
        "Actuated",
        "Chain",
        "Elbow",
        "Leg",
        "Link",
        "Locked",
        "Passive",
        "Rigid",
        "Robot",
        "Snapshot",
        "Telescope",
        "TelescopicBeam",
        "beam_link",
        "cylindrical",
        "planar",
        "prismatic",
        "revolute",
        "spherical",
        "universal",
    ),
    "robostiff.model.cable": ("Cable", "CableRobot", "Weight"),
    "robostiff.robots": (
        "load",
        "shipped_cable_robots",
        "shipped_linkages",
        "shipped_robots",
    ),
    "robostiff.robots.derivation": ("derive",),
    "robostiff.robots.descriptions": ("load_linkage",),
    "robostiff.elastostatics": (
        "Block",
        "IndexRules",
        "Recursive",
        "SaddlePoint",
        "Status",
        "Tolerance",
        "WrenchBasis",
        "chain_stiffness",
    ),
    "robostiff.elasticity": (
        "CrossSection",
        "Elasticity",
        "EulerBernoulli",
        "Material",
        "Timoshenko",
        "box",
        "circle",
        "i_section",
        "material",
        "rectangle",
        "rotational_spring",
        "translational_spring",
        "tube",
    ),
    "robostiff.io.model_file": ("ALL_PARAMETERS",),
    "robostiff.network": ("Network",),
    "robostiff.report": ("write_report",),
    "robostiff.spatial": ("Frame",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
_PACKAGES = ("plot",)

__all__ = [
    "ALL_PARAMETERS",
    "Actuated",
    "AtCoordinates",
    "AtHome",
    "AtSymbols",
    "Axis",
    "Backend",
    "Batched",
    "Block",
    "Cable",
    "CableResponse",
    "CableRobot",
    "CableStatus",
    "CableStiffness",
    "CableTensions",
    "Chain",
    "Closed",
    "ClosedFormTensions",
    "Compiled",
    "CompiledAnswer",
    "CompiledRobot",
    "ComplianceMatrix",
    "CrossSection",
    "Deflection",
    "DeflectionUnder",
    "Derivative",
    "Elasticity",
    "Elbow",
    "EulerBernoulli",
    "FileError",
    "Frame",
    "GivenTensions",
    "Grid",
    "IndexRules",
    "InputError",
    "JointCoordinates",
    "Leg",
    "Link",
    "Locked",
    "Material",
    "NearestTensions",
    "Network",
    "NoAnswerError",
    "NoMachineCodeWarning",
    "Passive",
    "PoseList",
    "PrincipalStiffness",
    "Quantity",
    "RandomPoses",
    "Recursive",
    "Rigid",
    "RobostiffError",
    "Robot",
    "RobotDerivation",
    "RobotStiffness",
    "SaddlePoint",
    "Snapshot",
    "Status",
    "Steps",
    "StiffnessIndices",
    "StiffnessMatrix",
    "Telescope",
    "TelescopicBeam",
    "Threads",
    "Timoshenko",
    "Tolerance",
    "Weight",
    "WorstDeflection",
    "WrenchBasis",
    "__version__",
    "beam_link",
    "box",
    "cable_response",
    "cable_stiffness",
    "cable_tensions",
    "chain_stiffness",
    "circle",
    "compile",
    "compliance",
    "cylindrical",
    "deflection",
    "derive",
    "find_posture",
    "i_section",
    "indices",
    "load",
    "load_linkage",
    "material",
    "planar",
    "prismatic",
    "rectangle",
    "revolute",
    "rotational_spring",
    "shipped_cable_robots",
    "shipped_linkages",
    "shipped_robots",
    "spherical",
    "stiffness",
    "stiffness_map",
    "translational_spring",
    "tube",
    "universal",
    "verify",
    "write_report",
]

if TYPE_CHECKING:
    from robostiff import plot as plot
    from robostiff.analysis import (
        CableResponse,
        CableStiffness,
        CableTensions,
        CompiledAnswer,
        CompiledRobot,
        Deflection,
        RobotStiffness,
        cable_response,
        cable_stiffness,
        cable_tensions,
        compile,
        compliance,
        deflection,
        stiffness,
        verify,
    )
    from robostiff.analysis.indices import StiffnessIndices, indices
    from robostiff.analysis.maps import (
        Axis,
        Batched,
        Compiled,
        Grid,
        PoseList,
        Quantity,
        RandomPoses,
        Threads,
        stiffness_map,
    )
    from robostiff.analytic import (
        AtCoordinates,
        AtHome,
        AtSymbols,
        Closed,
        RobotDerivation,
        Steps,
    )
    from robostiff.cables import CableStatus, ClosedFormTensions, GivenTensions, NearestTensions
    from robostiff.compiled import (
        Backend,
        ComplianceMatrix,
        DeflectionUnder,
        Derivative,
        NoMachineCodeWarning,
        PrincipalStiffness,
        StiffnessMatrix,
        WorstDeflection,
    )
    from robostiff.elasticity import (
        CrossSection,
        Elasticity,
        EulerBernoulli,
        Material,
        Timoshenko,
        box,
        circle,
        i_section,
        material,
        rectangle,
        rotational_spring,
        translational_spring,
        tube,
    )
    from robostiff.elastostatics import (
        Block,
        IndexRules,
        Recursive,
        SaddlePoint,
        Status,
        Tolerance,
        WrenchBasis,
        chain_stiffness,
    )
    from robostiff.errors import (
        FileError,
        InputError,
        NoAnswerError,
        RobostiffError,
    )
    from robostiff.io.model_file import (
        ALL_PARAMETERS,
    )
    from robostiff.kinematics import (
        JointCoordinates,
        find_posture,
    )
    from robostiff.model import (
        Actuated,
        Chain,
        Elbow,
        Leg,
        Link,
        Locked,
        Passive,
        Rigid,
        Robot,
        Snapshot,
        Telescope,
        TelescopicBeam,
        beam_link,
        cylindrical,
        planar,
        prismatic,
        revolute,
        spherical,
        universal,
    )
    from robostiff.model.cable import Cable, CableRobot, Weight
    from robostiff.network import (
        Network,
    )
    from robostiff.report import write_report
    from robostiff.robots import (
        load,
        shipped_cable_robots,
        shipped_linkages,
        shipped_robots,
    )
    from robostiff.robots.derivation import (
        derive,
    )
    from robostiff.robots.descriptions import (
        load_linkage,
    )
    from robostiff.spatial import (
        Frame,
    )


def __getattr__(name: str) -> Any:
    if name in _HOME_OF:
        value = getattr(import_module(_HOME_OF[name]), name)
        globals()[name] = value
        return value
    if name in _PACKAGES:
        return import_module(f"robostiff.{name}")
    raise AttributeError(f"module 'robostiff' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
