"""Records of robots turned into kernels: SIMD machine code, or NumPy in chunks."""

from robostiff.compiled.array_loops import PAGES as PAGES
from robostiff.compiled.array_loops import PLACES as PLACES
from robostiff.compiled.array_loops import count_by_digits as count_by_digits
from robostiff.compiled.array_loops import uniform_rows as uniform_rows
from robostiff.compiled.codes import ArrayCode as ArrayCode
from robostiff.compiled.codes import MachineCode as MachineCode
from robostiff.compiled.codes import machine_code_is_available as machine_code_is_available
from robostiff.compiled.codes import room_for as room_for
from robostiff.compiled.kernel import Backend as Backend
from robostiff.compiled.kernel import Kernel as Kernel
from robostiff.compiled.kernel import NoMachineCodeWarning as NoMachineCodeWarning
from robostiff.compiled.kernel import kernel_of as kernel_of
from robostiff.compiled.outputs import ComplianceMatrix as ComplianceMatrix
from robostiff.compiled.outputs import DeflectionUnder as DeflectionUnder
from robostiff.compiled.outputs import Derivative as Derivative
from robostiff.compiled.outputs import DisplacementUnder as DisplacementUnder
from robostiff.compiled.outputs import EntryOf as EntryOf
from robostiff.compiled.outputs import Gradient as Gradient
from robostiff.compiled.outputs import Output as Output
from robostiff.compiled.outputs import PrincipalStiffness as PrincipalStiffness
from robostiff.compiled.outputs import Rates as Rates
from robostiff.compiled.outputs import StiffnessMatrix as StiffnessMatrix
from robostiff.compiled.outputs import TotalMass as TotalMass
from robostiff.compiled.outputs import WorstDeflection as WorstDeflection
from robostiff.compiled.source_code import SourceLanguage as SourceLanguage
from robostiff.compiled.source_code import source_of as source_of
