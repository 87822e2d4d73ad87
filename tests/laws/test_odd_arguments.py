"""Every public callable, with arguments of every wrong kind: RobostiffError, or an answer.

Each parameter in turn is of another kind while the others are good. The table of good arguments is
complete: a public callable that is not in it is named by a test.
"""

# pyright: reportArgumentType=false

import enum
import inspect
import re
import subprocess
import sys
import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

import robostiff as rs
from robostiff.network import Node, beam_between

ODD = {
    "none": None, "whole number": 3, "negative": -2.5, "not a number": float("nan"),
    "infinite": float("inf"), "true": True, "word": "x", "quantity": "5 mm", "empty text": "",
    "long text": "a" * 2000, "empty list": [], "list": [1.0], "list of words": ["x", "y"],
    "list of none": [None], "ragged list": [[1.0], [2.0, 3.0]], "three ones": np.ones(3),
    "matrix": np.ones((6, 6)), "no numbers": np.array(["a", "b"]), "object": object(),
    "mapping": {"a": 1}, "set": {1, 2}, "complex": 1j, "bytes": b"x", "function": len,
    "class": float, "frame": rs.Frame.identity(), "role": rs.Passive(),
}  # fmt: skip
STEEL, BAR, HERE = rs.material("steel"), rs.circle(0.02), rs.Frame.identity()
CABLES, PLATFORM = rs.load("cable-3-suspended"), rs.load("gough-stewart-b", symbols=("k",))


def _chain():
    spring = rs.revolute([0, 0, 1], rs.Actuated(1e4))
    return rs.Chain((spring, rs.beam_link([0.3, 0, 0], STEEL, BAR)))


def _leg(name="arm"):
    return rs.Leg(name, HERE, _chain(), HERE)


def _arm():
    return rs.Robot("arm", (_leg(),))


def _network():
    a, b = Node("a", np.zeros(3)), Node("b", np.array([0.3, 0, 0]))
    y_axis = np.array([0.0, 1, 0])
    beam = beam_between(a, b, STEEL, BAR, y_axis=y_axis, name="beam")
    return rs.Network("n", (a, b), ("a",), "b", b.point, beams=(beam,))


def _path():
    Path("path.csv").write_text("x [mm],z [mm],Fz [N]\n0,900,-10\n", encoding="utf-8")
    return "path.csv"


def _measured():
    return rs.Measurements([[0, 0, 0.9, 0, 0, 0]], [[1e-6, 0, 2e-6]], wrenches=LOAD,
                           kinds=rs.Reading.DISPLACEMENT)  # fmt: skip


LOAD, HOME = [0, 0, -1.0, 0, 0, 0], [[0, 0, 0.8, 0, 0, 0]]
Z = [0, 0, 1.0]
LOADED = {"wrench": LOAD, "beams": rs.Linear()}
ARRAYS, FREE = {"backend": rs.Backend.ARRAYS}, {"role": rs.Passive()}


def _same(own):
    """What an object was made with."""
    return {key: getattr(own, key) for key in inspect.signature(type(own)).parameters}


#: Public callables with good arguments, each made when it is needed; others have their defaults.
GOOD = {
    **dict.fromkeys((rs.Batched, rs.AtHome, rs.AtJoints, rs.Steps, rs.UnitQuaternion), dict),
    **dict.fromkeys((rs.AtSymbols, rs.Closed, rs.EulerAngles, rs.roll_pitch_yaw), dict),
    **dict.fromkeys((rs.ComplianceMatrix, rs.PrincipalStiffness, rs.StiffnessMatrix), dict),
    **dict.fromkeys((rs.WorstDeflection, rs.TotalMass, rs.EulerBernoulli, rs.Timoshenko), dict),
    **dict.fromkeys((rs.WrenchBasis, rs.Block, rs.IndexRules, rs.Recursive, rs.SaddlePoint), dict),
    **dict.fromkeys((rs.Tolerance, rs.Passive, rs.Linear, rs.Bowing, rs.Mirror, rs.Exact), dict),
    **dict.fromkeys((rs.Mean, rs.Worst, rs.PNorm, rs.Threads, rs.Quantiles), dict),
    **dict.fromkeys((rs.UnknownFrames, rs.Squares, rs.Robust, rs.DOptimal, rs.AOptimal), dict),
    **dict.fromkeys((rs.ClosedFormTensions, rs.NearestTensions, rs.UnderLoad), dict),
    **dict.fromkeys((rs.shipped_cable_robots, rs.shipped_linkages, rs.shipped_robots), dict),
    **dict.fromkeys(
        (rs.compliance, rs.stiffness, rs.verify, rs.indices, rs.actuator_names, rs.find_posture),
        lambda: {"robot": _arm()},
    ),
    **dict.fromkeys((rs.cable_stiffness, rs.cable_tensions), lambda: {"robot": CABLES}),
    **dict.fromkeys((rs.DeflectionUnder, rs.DisplacementUnder), lambda: {"wrench": LOAD}),
    rs.TensionsOf: lambda: {"names": ["cable1", "cable2"]},
    **dict.fromkeys(
        (rs.rotational_spring, rs.translational_spring), lambda: {"stiffness": 1e3, "axis": Z}
    ),
    **dict.fromkeys((rs.cylindrical, rs.prismatic, rs.revolute), lambda: {"axis": Z, **FREE}),
    **dict.fromkeys((rs.critical_load, rs.equilibrium), lambda: {"robot": _arm(), **LOADED}),
    rs.cable_response: lambda: {"robot": CABLES, "wrench": LOAD},
    rs.compile: lambda: {"robot": _arm(), **ARRAYS},
    rs.Axis: lambda: {"start": 0.0, "stop": 1.0, "count": 2},
    rs.Compiled: lambda: ARRAYS,
    rs.Grid: lambda: {"x": rs.Axis(0, 1, 2)},
    rs.PoseList: lambda: {"names": ("x",), "poses": [[0.0], [1.0]]},
    rs.RandomPoses: lambda: {"count": 2, "ranges": {"x": (0, 1)}},
    rs.Extremes: lambda: {"of": "rank"},
    rs.Histogram: lambda: {"of": "rank", "edges": [0, 1]},
    rs.ShareAbove: lambda: {"of": "rank", "limits": 1.0},
    rs.stiffness_map: lambda: {
        **{"robot": _arm(), "poses": rs.Grid(revolute=rs.Axis(0, 1, 2)), "method": rs.Batched()}
    },
    rs.AtCoordinates: lambda: {"values": {"x": 0}, "rotation": rs.EulerAngles()},
    rs.GivenTensions: lambda: {"values": [1.0, 2.0]},
    rs.Derivative: lambda: {"of": rs.StiffnessMatrix(), "by": "x"},
    rs.CrossSection: lambda: {"A": 1e-4, "Iy": 1e-9, "Iz": 1e-9, "J": 2e-9},
    rs.Elasticity: lambda: {"compliance": np.eye(6), "freedoms": np.zeros((6, 0))},
    rs.Material: lambda: {"name": "m", "E": 2e11, "G": 8e10, "density": 7800.0},
    rs.box: lambda: {"width_y": 0.1, "height_z": 0.1, "wall": 0.01},
    rs.circle: lambda: {"diameter": 0.1},
    rs.i_section: lambda: {
        **{"flange_width": 0.1, "height": 0.2, "web_thickness": 0.01, "flange_thickness": 0.01}
    },
    rs.material: lambda: {"name": "steel"},
    rs.rectangle: lambda: {"width_y": 0.1, "height_z": 0.2},
    rs.tube: lambda: {"outer_diameter": 0.1, "inner_diameter": 0.08},
    rs.chain_stiffness: lambda: {"C": np.eye(6), "J_q": np.eye(6)[:, :1]},
    rs.ActuatorCoordinates: lambda: {"values": [0.0]},
    rs.JointCoordinates: lambda: {"values": [0.0]},
    rs.Module: lambda: {"name": "m", "part": _chain()},
    rs.ToolPose: lambda: {"tip": [0, 0, 0], "axis": Z},
    rs.hybrid_machine: lambda: {"modules": (rs.Module("m", _chain()), rs.Module("n", _chain()))},
    rs.postures: lambda: {"robot": rs.load("hexapod")},
    rs.Actuated: lambda: {"stiffness": 1e4, "limits": (-1.0, 1.0)},
    rs.BodyPoint: lambda: {"body": "base", "at": [0, 0, 0]},
    rs.BodySpring: lambda: {"name": "s",
        "between": (rs.BodyPoint("base"), rs.BodyPoint("platform", Z)), "stiffness": 1e3,
        "free_length": 0.1},
    rs.Chain: lambda: {"elements": _chain().elements},
    rs.Coupling: lambda: {"terms": (("a", 1.0), ("b", 2.0))},
    rs.DHRow: lambda: {"a": 0.1},
    rs.ForceLaw: lambda: {"force": [[0.0, 0.0], [1.0, 2.0]]},
    rs.Leg: lambda: {"name": "arm", "base": HERE, "chain": _chain(), "attachment": HERE},
    rs.Link: lambda: {"to": np.ones(3), "elasticity": rs.Elasticity(np.eye(6)), "axes": np.eye(3)},
    rs.Locked: lambda: {"stiffness": 1e3},
    rs.Mass: lambda: {"value": 1.0, "centre": [0, 0, 0]},
    rs.Rigid: lambda: {"transform": HERE},
    rs.Robot: lambda: {"name": "arm", "legs": (_leg(),), "home": HERE,
        "reference_point": np.zeros(3), "nominal": {}, "meanings": {}, "laws": {}},
    rs.Snapshot: lambda: {"name": "s", "legs": rs.find_posture(_arm()).snapshot.one(0).legs,
        "reference_point": np.zeros(3)},
    rs.Telescope: lambda: {"direction": np.array(Z), "axes": np.eye(3), "role": rs.Actuated(1e5),
        "home": 0.5, "beams": (rs.TelescopicBeam(STEEL, BAR, 1.0),)},
    rs.TelescopicBeam: lambda: {"material": STEEL, "section": BAR, "share": 1.0,
        "theory": rs.EulerBernoulli()},
    rs.beam_link: lambda: {
        **{"to": Z, "material": STEEL, "section": BAR, "y_axis": [0, 1, 0]}
    },
    rs.coupling: lambda: {"joint": "a", "follows": "b", "ratio": 2.0},
    rs.helical: lambda: {"axis": Z, "pitch": 0.005, **FREE},
    rs.planar: lambda: {"normal": Z, **FREE},
    rs.serial_arm: lambda: {"dh": (rs.DHRow(a=0.3), rs.DHRow(a=0.2)),
        "convention": rs.DHConvention.STANDARD, "joint_stiffness": 1e4},
    rs.spherical: lambda: FREE,
    rs.universal: lambda: {"axis1": Z, "axis2": [1, 0, 0], **FREE},
    rs.Cable: lambda: {"name": "c", "exit_point": [1, 0, 0], "attachment": [0, 0, 0], "EA": 1e5,
        "greatest_tension": 100.0},
    rs.CableRobot: lambda: _same(CABLES),
    rs.Weight: lambda: {"force": [0, 0, -1.0], "point": [0, 0, 0]},
    rs.DistributedForce: lambda: {"per_length": [0, 0, -1.0]},
    rs.ForceOnBeam: lambda: {"force": [0, 0, -1.0], "distance": 0.1},
    rs.Network: lambda: _same(_network()),
    rs.network_at: lambda: {"linkage": rs.load_linkage("double-pantograph"), "values": {}},
    rs.network_response: lambda: {"network": _network(), "loads": {"b": LOAD}},
    rs.load: lambda: {"name_or_path": "planar-link"},
    rs.load_linkage: lambda: {"path": "double-pantograph"},
    rs.derive: lambda: {"robot": rs.load("planar-link"), "budget": 1.0},
    rs.Frame: lambda: {"R": np.eye(3), "p": np.zeros(3)},
    rs.DeadForce: lambda: {"force": [0, 0, -1.0]},
    rs.compile_loaded: lambda: {"robot": _arm(), "beams": rs.Linear(), **ARRAYS},
    rs.deflection: lambda: {"robot": _arm(), "wrench": LOAD},
    rs.load_path: lambda: {"robot": _arm(), **LOADED, "factors": [0.0, 1.0]},
    rs.modes: lambda: {"robot": _arm(), **LOADED, "masses": {"arm/beam": 1.0}},
    rs.write_report: lambda: {"robot": _arm(), "path": "report.html"},
    rs.EntryOf: lambda: {"of": rs.StiffnessMatrix(), "place": (0, 0)},
    rs.Gradient: lambda: {"of": rs.WorstDeflection(), "by": ("x", "y")},
    rs.Uniform: lambda: {"half_width": 0.1},
    rs.Normal: lambda: {"deviation": "1 mm"},
    rs.Within: lambda: {"output": rs.WorstDeflection(), "most": 1e-6},
    rs.mass_below: lambda: {"most": 10.0},
    rs.value_and_gradient: lambda: {
        **{"robot": PLATFORM, "output": rs.WorstDeflection(), "by": ("k",)}
    },
    rs.optimise: lambda: {"robot": PLATFORM, "objective": rs.WorstDeflection(),
        "variables": {"k": (1e6, 1e7)}},
    **dict.fromkeys(
        (rs.tolerances, rs.sobol_indices),
        lambda: {"robot": PLATFORM, "spreads": {"k": rs.Uniform(0.1)}, "samples": 8},
    ),
    rs.compensate: lambda: {"robot": rs.load("gough-stewart-b"), "path": HOME, "wrenches": LOAD,
        "beams": rs.Linear()},
    rs.read_program: lambda: {"robot": rs.load("hexapod"), "path": _path()},
    rs.write_program: lambda: {"program": rs.read_program(rs.load("hexapod"), _path()),
        "found": rs.compensate(rs.load("gough-stewart-b"), HOME, LOAD), "path": "out.csv"},
    rs.Measurements: lambda: {"postures": [[0, 0, 0.9, 0, 0, 0]], "values": [[1e-6, 0, 2e-6]],
        "wrenches": LOAD, "forces": Z, "hooks": Z, "sigma": 1e-6, "toward": Z,
        "kinds": rs.Reading.DISPLACEMENT, "references": [-1], "sigma_wrench": [1.0] * 6},
    rs.KnownFrames: lambda: {"markers": {"marker": Z}},
    rs.TestPose: lambda: {"postures": [[0, 0, 0.9, 0, 0, 0]], "wrenches": LOAD},
    rs.identify: lambda: {"robot": rs.load("hexapod"), "measured": _measured(),
        "parameters": ["leg1/strut"], "frames": rs.KnownFrames({"marker": Z})},
    rs.random_postures: lambda: {"robot": rs.load("hexapod"), "count": 3},
    rs.choose_poses: lambda: {"robot": rs.load("gough-stewart-b"),
        "candidates": [*HOME, [0, 0, 0.75, 0, 0, 0.1]], "count": 2, "parameters": ["leg1/actuator"],
        "markers": {"a": Z, "b": [1, 0, 0]}, "forces": [900.0, 100, -2000], "hook": Z,
        "sigma": 1e-6, "repeats": True, "starts": 1},
}  # fmt: skip
#: Processes, which take long; and what has another name among the arguments.
LEFT_OUT = {rs.stiffness_map: ("workers",), rs.Grid: ("axes",)}
#: Those that take long also where the argument is refused in the end.
LONG = {
    *(rs.compile_loaded, rs.critical_load, rs.load_linkage, rs.load_path),
    *(rs.modes, rs.write_report, rs.optimise, rs.tolerances, rs.compensate, rs.value_and_gradient),
    *(rs.read_program, rs.write_program, rs.sobol_indices),
    *(rs.identify, rs.choose_poses, rs.stiffness_map),
}
FEW = ("whole number", "word", "list of none", "object")
#: Answers, which functions make.
ANSWERS = {
    *(rs.CableResponse, rs.CableStiffness, rs.CableTensions, rs.CompiledAnswer),
    *(rs.CompiledStiffness, rs.CompiledLoading, rs.CriticalLoad, rs.Deflection),
    *(rs.Equilibrium, rs.IndicesOfPoses, rs.Mode, rs.Modes),
    *(rs.RobotDerivation, rs.Stiffness, rs.StiffnessIndices),
    *(rs.Compensation, rs.Optimum, rs.Tolerances, rs.Identified, rs.ChosenPoses),
}


def _public():
    stub = Path(rs.__file__).with_name("__init__.pyi").read_text(encoding="utf-8")
    for name in re.findall(r"import (?:\w+ as )?(\w+)$", stub, re.MULTILINE):
        value = getattr(rs, name)
        is_kind = inspect.isclass(value) and issubclass(value, (BaseException, enum.Enum))
        if callable(value) and not is_kind:
            yield value


def test_the_table_has_every_public_callable():
    assert {own.__name__ for own in _public()} == {own.__name__ for own in {*GOOD, *ANSWERS}}


def _good(function):
    """Good arguments, defaults among them."""
    parameters = inspect.signature(function).parameters.values()
    defaults = {own.name: own.default for own in parameters if "<factory>" not in repr(own.default)}
    own = {name: value for name, value in defaults.items() if value is not inspect.Parameter.empty}
    for name in LEFT_OUT.get(function, ()):
        del own[name]
    return own | GOOD[function]()


def _called(function, arguments):
    """A call with some arguments; a positional one where it has no other name."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if function is rs.Grid and not isinstance(arguments.get("x"), rs.Axis):
            function(arguments["x"])
        return function(**arguments)


@pytest.mark.parametrize("function", GOOD, ids=lambda own: own.__name__)
def test_odd_arguments_are_refused_in_words(function, tmp_path, monkeypatch):
    """No foreign exception from any argument of another kind; good arguments are good."""
    monkeypatch.chdir(tmp_path)
    foreign, accepted = [], []
    good = _good(function)
    _called(function, good)
    kinds = FEW if function in LONG else ODD
    for parameter in good:
        for kind in kinds:
            odd = ODD[kind]
            if callable(odd) and parameter in ("where", "progress"):
                continue  # a function of the user's, whose exceptions are its own
            try:
                _called(function, {**good, parameter: odd})
                accepted += [parameter] if kind == "object" else []
            except rs.RobostiffError:
                pass
            except Exception as error:
                foreign.append(f"{parameter}={kind}: {type(error).__name__}: {error}"[:110])
    assert not foreign, "\n".join(foreign)
    if inspect.isfunction(function):
        assert not accepted, "what is nothing was taken for something"
        assert not _taken_in_silence(function, good)


#: Values of the kinds that are meant, or near them, which no function takes in silence.
REFUSED = {
    "pose": ("home", [1.0, 2.0]), "near": ("home",), "at": ("x", [0, 0]), "wrench": ("x", [1.0]),
    "loads": ("x", {"nothing": 1}), "gravity": ("w", "down", [0, -9.81]), "preload": ({"no": 1},),
    "laws": ({"no": 1},), "beams": (3, "x", rs.Bowing), "tolerance": (1e-9, "x"),
    "length": (-1.0, "x", [1.0, 2.0]), "tensions": (3, "nearest"), "fixed": ("x", ["nothing"]),
    "parameters": ("nothing", ["nothing"]), "axes": ("world", 3), "method": ("exact", 3),
    "loss": ("robust", 1.0), "frames": ("known", 3), "criterion": ("d", 3), "backend": ("c", 3),
    "shared": (3, "yes"), "repeats": (3, "yes"), "resume": (3, "yes"), "finite": (3, "yes"),
    "allow_xacro": (3, "yes"), "symbols": ("nothing", ["nothing"]), "form": ("closed", 3),
    "seed": (1.5, True), "samples": (1.5, True, -1), "count": (1.5, True, -1), "hook": (3, "x"),
    "starts": (1.5, True), "name": (3,), "title": (3,), "source": (3,), "leg": (3, "nothing"),
}  # fmt: skip


def _taken_in_silence(function, good):
    accepted = []
    for name in (own for own in good if own in REFUSED):
        for value in REFUSED[name]:
            with suppress(rs.InputError):
                _called(function, {**good, name: value})
                accepted.append((name, value))
    return accepted


def test_kinds_of_arguments_do_not_depend_on_what_was_imported(tmp_path):
    """The annotation names a class that its module imports for type checkers alone."""
    code = (
        "import sys, robostiff as rs\n"
        "robot = rs.load('hexapod')\n"
        "print('xarray' in sys.modules)\n"
        "try:\n"
        "    rs.write_report(robot, sys.argv[1], found=3)\n"
        "except rs.InputError as error:\n"
        "    print(error)\n"
    )
    command = [sys.executable, "-c", code, str(tmp_path / "report.html")]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    before, error = done.stdout.splitlines()
    assert before == "False"
    assert error == "found of write_report: got 3, expected xarray.Dataset or None"
