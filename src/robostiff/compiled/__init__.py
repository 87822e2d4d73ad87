"""Records of robots turned into kernels: SIMD machine code, or NumPy in chunks."""

from robostiff.compiled.codes import ArrayCode, MachineCode, room_for
from robostiff.compiled.kernel import (
    Backend,
    Kernel,
    NoMachineCodeWarning,
    kernel_of,
    whole_threads,
)
from robostiff.compiled.machine_code import machine_code_is_available
from robostiff.compiled.outputs import (
    ComplianceMatrix,
    DeflectionUnder,
    DisplacementUnder,
    EntryOf,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    TotalMass,
    WorstDeflection,
)
from robostiff.compiled.rates import Derivative, Gradient, Rates
from robostiff.compiled.source_code import SourceLanguage, source_of

__all__ = [
    "ArrayCode",
    "Backend",
    "ComplianceMatrix",
    "DeflectionUnder",
    "Derivative",
    "DisplacementUnder",
    "EntryOf",
    "Gradient",
    "Kernel",
    "MachineCode",
    "NoMachineCodeWarning",
    "Output",
    "PrincipalStiffness",
    "Rates",
    "SourceLanguage",
    "StiffnessMatrix",
    "TotalMass",
    "WorstDeflection",
    "kernel_of",
    "machine_code_is_available",
    "room_for",
    "source_of",
    "whole_threads",
]
