"""Cartesian stiffness of robots with elastic links, elastic actuators and passive joints.

    import robostiff as rs

    robot = rs.load("gough-stewart-b")
    result = rs.stiffness(robot, [0, 0, 0.8, 0, 0, 0])
    result.K, result.rank, result.free_motions, result.status

Names are imported when they are first used, so that the command line starts at once; type checkers
read ``__init__.pyi``.
"""

from __future__ import annotations

from importlib import import_module
from typing import Any

from robostiff.version import __version__

_HOMES = {
    "robostiff.analysis": (
        "CableResponse",
        "CableStiffness",
        "CableTensions",
        "CompiledAnswer",
        "CompiledLinkage",
        "CompiledRobot",
        "Deflection",
        "DeflectionsOfPoses",
        "RobotStiffness",
        "cable_stiffness",
        "cable_tensions",
        "compile",
        "compliance",
        "stiffness",
        "verify",
    ),
    "robostiff.analysis.indices": ("IndicesOfPoses", "StiffnessIndices", "indices"),
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
    "robostiff.cables": ("ClosedFormTensions", "GivenTensions", "NearestTensions"),
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
        "AtJoints",
        "AtSymbols",
        "Closed",
        "EulerAngles",
        "RobotDerivation",
        "Steps",
        "UnitQuaternion",
        "roll_pitch_yaw",
    ),
    "robostiff.errors": (
        "DisagreementError",
        "FileError",
        "InputError",
        "NoAnswerError",
        "PlausibilityWarning",
        "RobostiffError",
    ),
    "robostiff.kinematics": (
        "ActuatorCoordinates",
        "JointCoordinates",
        "Module",
        "ToolPose",
        "actuator_names",
        "find_posture",
        "hybrid_machine",
        "postures",
    ),
    "robostiff.model": (
        "Actuated",
        "BodyPoint",
        "BodySpring",
        "Chain",
        "Coupling",
        "DHConvention",
        "DHRow",
        "Elbow",
        "ForceLaw",
        "Leg",
        "Link",
        "Locked",
        "Mass",
        "Passive",
        "Rigid",
        "Robot",
        "Snapshot",
        "Telescope",
        "TelescopicBeam",
        "beam_link",
        "coupling",
        "cylindrical",
        "helical",
        "planar",
        "prismatic",
        "revolute",
        "serial_arm",
        "spherical",
        "universal",
    ),
    "robostiff.model.cable": ("Cable", "CableRobot", "Weight"),
    "robostiff.robots": ("load", "shipped_cable_robots", "shipped_linkages", "shipped_robots"),
    "robostiff.robots.derivation": ("derive", "derive_under_load"),
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
    "robostiff.network": ("DistributedForce", "ForceOnBeam", "Network", "network_response"),
    "robostiff.report": ("write_report",),
    "robostiff.spatial": ("Frame",),
    "robostiff.statics": (
        "Bowing",
        "CompiledLoading",
        "CriticalLoad",
        "DeadForce",
        "Equilibria",
        "Equilibrium",
        "Linear",
        "LoadedAnswer",
        "Mode",
        "Modes",
        "cable_response",
        "compile_loaded",
        "critical_load",
        "deflection",
        "equilibrium",
        "load_path",
        "modes",
    ),
    "robostiff.statics.loaded_map": ("UnderLoad",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
_PACKAGES = ("plot",)

__all__ = ["__version__"]
__all__ += sorted(_HOME_OF)  # noqa: PLE0605  # pyright: ignore[reportUnsupportedDunderAll]


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
