"""Records of robots turned into kernels: SIMD machine code, or NumPy in chunks."""

from robostiff.compiled.codes import ArrayCode, MachineCode
from robostiff.compiled.kernel import (
    Backend,
    Checks,
    Kernel,
    NoMachineCodeWarning,
    kernel_of,
    whole_threads,
)
from robostiff.compiled.machine_code import machine_code_is_available
from robostiff.compiled.outputs import (
    ComplianceMatrix,
    DeflectionUnder,
    Derivative,
    Output,
    PrincipalStiffness,
    StiffnessMatrix,
    WorstDeflection,
    rows_of,
    unpack,
    upper_triangle,
)

__all__ = [
    "ArrayCode",
    "Backend",
    "Checks",
    "ComplianceMatrix",
    "DeflectionUnder",
    "Derivative",
    "Kernel",
    "MachineCode",
    "NoMachineCodeWarning",
    "Output",
    "PrincipalStiffness",
    "StiffnessMatrix",
    "WorstDeflection",
    "kernel_of",
    "machine_code_is_available",
    "rows_of",
    "unpack",
    "upper_triangle",
    "whole_threads",
]
