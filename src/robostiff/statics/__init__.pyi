from robostiff.statics.cable_response import cable_response
from robostiff.statics.chains.beam_bowing import Bowing, Linear
from robostiff.statics.chains.elements import BodyPlace
from robostiff.statics.equilibrium import equilibrium
from robostiff.statics.growing_load import CriticalLoad, critical_load, load_path
from robostiff.statics.kernels.compile import compile_loaded
from robostiff.statics.kernels.compiled_loading import CompiledLoading
from robostiff.statics.loaded_parts import BodyPlaces, LoadedPart
from robostiff.statics.loading.given_loads import DeadForce, has_masses
from robostiff.statics.modes import Mode, Modes, modes
from robostiff.statics.result import Equilibrium
from robostiff.statics.small_loads import deflection

__all__ = [
    "BodyPlace",
    "BodyPlaces",
    "Bowing",
    "CompiledLoading",
    "CriticalLoad",
    "DeadForce",
    "Equilibrium",
    "Linear",
    "LoadedPart",
    "Mode",
    "Modes",
    "cable_response",
    "compile_loaded",
    "critical_load",
    "deflection",
    "equilibrium",
    "has_masses",
    "load_path",
    "modes",
]
