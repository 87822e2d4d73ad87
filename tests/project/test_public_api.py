"""What `import robostiff as rs` offers: pinned, documented, and cheap."""

import ast
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import robostiff as rs
from tests.project.shown_output import ROOT

PUBLIC = [
    "ALL_PARAMETERS",
    "AOptimal",
    "Actuated",
    "ActuatorCoordinates",
    "AtCoordinates",
    "AtHome",
    "AtJoints",
    "AtSymbols",
    "Axes",
    "Axis",
    "Backend",
    "Batched",
    "Block",
    "BodyPoint",
    "BodySpring",
    "Bowing",
    "Cable",
    "CableResponse",
    "CableRobot",
    "CableStiffness",
    "CableTensions",
    "Chain",
    "ChosenPoses",
    "Closed",
    "ClosedFormTensions",
    "Compensation",
    "Compiled",
    "CompiledAnswer",
    "CompiledLoading",
    "CompiledStiffness",
    "ComplianceMatrix",
    "Coupling",
    "CriticalLoad",
    "CrossSection",
    "DHConvention",
    "DHRow",
    "DOptimal",
    "DeadForce",
    "Deflection",
    "DeflectionUnder",
    "DeflectionsOfPoses",
    "Derivative",
    "DisagreementError",
    "DisplacementUnder",
    "DistributedForce",
    "Elasticity",
    "Elbow",
    "Ending",
    "EntryOf",
    "Equilibria",
    "Equilibrium",
    "EulerAngles",
    "EulerBernoulli",
    "Exact",
    "Extremes",
    "FileError",
    "FitStatus",
    "ForceLaw",
    "ForceOnBeam",
    "Frame",
    "GivenTensions",
    "Gradient",
    "Grid",
    "Histogram",
    "Identified",
    "IndexRules",
    "IndicesOfPoses",
    "InputError",
    "JointCoordinates",
    "KnownFrames",
    "Leg",
    "Linear",
    "Link",
    "LoadAxes",
    "LoadedAnswer",
    "Locked",
    "Mass",
    "Material",
    "Mean",
    "Measurements",
    "Mirror",
    "Mode",
    "Modes",
    "ModesOfPoses",
    "Module",
    "NearestTensions",
    "Network",
    "NoAnswerError",
    "NoMachineCodeWarning",
    "Normal",
    "Optimum",
    "PNorm",
    "Passive",
    "PlausibilityWarning",
    "PoseList",
    "PrincipalStiffness",
    "Quantiles",
    "Quantity",
    "RandomPoses",
    "Reading",
    "Recursive",
    "Rigid",
    "RobostiffError",
    "Robot",
    "RobotDerivation",
    "Robust",
    "SaddlePoint",
    "ShareAbove",
    "Snapshot",
    "SourceLanguage",
    "Squares",
    "Status",
    "Steps",
    "Stiffness",
    "StiffnessIndices",
    "StiffnessMatrix",
    "Telescope",
    "TelescopicBeam",
    "TestPose",
    "Threads",
    "Timoshenko",
    "Tolerance",
    "Tolerances",
    "ToolPose",
    "TotalMass",
    "UnderLoad",
    "Uniform",
    "UnitQuaternion",
    "UnknownFrames",
    "Weight",
    "Within",
    "Worst",
    "WorstDeflection",
    "WrenchBasis",
    "actuator_names",
    "beam_link",
    "box",
    "cable_response",
    "cable_stiffness",
    "cable_tensions",
    "chain_stiffness",
    "choose_poses",
    "circle",
    "compensate",
    "compile",
    "compile_loaded",
    "compliance",
    "coupling",
    "critical_load",
    "cylindrical",
    "deflection",
    "derive",
    "equilibrium",
    "find_posture",
    "helical",
    "hybrid_machine",
    "i_section",
    "identify",
    "indices",
    "load",
    "load_linkage",
    "load_path",
    "mass_below",
    "material",
    "modes",
    "network_at",
    "network_response",
    "optimise",
    "planar",
    "postures",
    "prismatic",
    "random_postures",
    "read_program",
    "rectangle",
    "revolute",
    "roll_pitch_yaw",
    "rotational_spring",
    "serial_arm",
    "shipped_cable_robots",
    "shipped_linkages",
    "shipped_robots",
    "sobol_indices",
    "spherical",
    "stiffness",
    "stiffness_map",
    "tolerances",
    "translational_spring",
    "tube",
    "universal",
    "value_and_gradient",
    "verify",
    "write_program",
    "write_report",
]
PACKAGES = [
    "analysis",
    "analysis.indices",
    "analysis.maps",
    "cables",
    "compiled",
    "elasticity",
    "elastostatics",
    "errors",
    "kinematics",
    "model",
    "network",
    "robots",
    "spatial",
]
HEAVY = (
    "numpy",
    "scipy",
    "pydantic",
    "pint",
    "click",
    "rich",
    "ruamel",
    "sympy",
    "matplotlib",
    "xarray",
    "zarr",
    "dask",
    "distributed",
    "llvmlite",
    "jaxtyping",
    "flint",
    "mujoco",
    "yourdfpy",
    "plotly",
)


def test_public_names_are_these():
    assert [name for name in rs.__all__ if name != "__version__"] == PUBLIC


def test_type_checkers_read_the_same_names_from_the_same_places():
    stub = ast.parse((ROOT / "src/robostiff/__init__.pyi").read_text(encoding="utf-8"))
    imports = [node for node in stub.body if isinstance(node, ast.ImportFrom)]
    imported = {name.asname: node.module for node in imports for name in node.names}
    assert set(imported) == {*rs.__all__, "plot"}
    for name, home in imported.items():
        public = getattr(rs, str(name))
        assert getattr(import_module(str(home)), str(name)) is public


def test_public_names_are_documented():
    page = (ROOT / "docs/api/robostiff.md").read_text(encoding="utf-8")
    documented = re.findall(
        r"auto(?:function|class|exception|data):: robostiff\.(\w+)$", page, re.M
    )
    assert sorted(documented) == PUBLIC


@pytest.mark.parametrize("name", PUBLIC)
def test_public_name_can_be_imported_and_has_a_docstring(name: str):
    assert getattr(rs, name).__doc__
    assert name in dir(rs)


@pytest.mark.parametrize(
    "package",
    [
        "analysis",
        "cables",
        "compiled",
        "elasticity",
        "elastostatics",
        "errors",
        "kinematics",
        "model",
        "robots",
        "spatial",
    ],
)
def test_every_name_that_a_package_lists_exists(package: str):
    module = import_module(f"robostiff.{package}")
    names = getattr(module, "__all__", [])
    assert names == sorted(set(names), key=names.index)
    assert all(hasattr(module, name) for name in names)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="stifness"):
        _ = rs.stifness  # pyright: ignore[reportAttributeAccessIssue]


def test_submodules_do_not_hide_functions():
    code = (
        "import robostiff as rs, robostiff.analysis, robostiff.cli.arguments\n"
        "assert all(callable(getattr(rs, n)) for n in ('stiffness', 'deflection', 'compliance'))"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_import_is_light():
    assert loaded_by("import robostiff") == []


def test_help_is_light():
    code = (
        "import contextlib, io, sys; sys.argv = ['robostiff', '--help']\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        "    from robostiff.cli.main import main; main()"
    )
    assert set(loaded_by(code)) <= {"click"}


@pytest.mark.parametrize(
    ("command", "needed"),
    [
        ("robots", {"ruamel"}),
        ("stiffness hexapod", {"numpy", "pydantic", "ruamel"}),
        ("stiffness gough-stewart-a --json", {"numpy", "pydantic", "ruamel"}),
        ("check 3-rpr", {"numpy", "pydantic", "ruamel", "rich"}),
        ("indices hexapod", {"numpy", "pydantic", "ruamel", "rich"}),
        ("deflection hexapod --wrench 100,0,0,0,0,0", {"numpy", "pydantic", "ruamel"}),
        ("equilibrium hexapod --wrench 100,0,0,0,0,0", {"numpy", "pydantic", "ruamel"}),
    ],
)
def test_commands_load_what_they_use(command: str, needed: set[str]):
    code = (
        "import contextlib, io, sys\n"
        f"sys.argv = ['robostiff', *{command.split()}]\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        "    from robostiff.cli.main import main; main()"
    )
    assert set(loaded_by(code)) <= {"click", *needed}


def test_one_matrix_of_a_robot_of_legs_loads_no_other_kinds_of_robots():
    code = (
        "import sys, robostiff as rs; rs.stiffness(rs.load('hexapod')).K\n"
        "print(*(n for n in sys.modules if n.startswith('robostiff.')))"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    )
    others = {
        *("model.cable", "io.model_file.cables", "network.network", "linkage.linkage"),
        *("kinematics.formula", "kinematics.postures"),
    }
    assert not {f"robostiff.{name}" for name in others} & set(loaded.stdout.split())
    assert "robostiff.model.robot" in loaded.stdout.split()


def test_a_page_of_stiffness_loads_no_other_questions():
    code = (
        "import contextlib, io, sys\n"
        "sys.argv = ['robostiff', 'stiffness', 'hexapod']\n"
        "with contextlib.redirect_stdout(io.StringIO()), contextlib.suppress(SystemExit):\n"
        "    from robostiff.cli.main import main; main()\n"
        "print(*{n.split('.')[1] for n in sys.modules if n.startswith('robostiff.')})"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    )
    others = {"cables", "compensation", "linkage", "network", "recorded", "statics"}
    assert not others & set(loaded.stdout.split())
    assert {"kinematics", "page"} <= set(loaded.stdout.split())


def test_a_package_and_its_names_are_in_step():
    for package in ("analysis", "kinematics", "linkage", "network", "statics"):
        module = import_module(f"robostiff.{package}")
        stub = ast.parse(Path(str(module.__file__)).with_suffix(".pyi").read_text("utf-8"))
        listed = next(node.value for node in stub.body if isinstance(node, ast.Assign))
        assert ast.literal_eval(listed) == module.__all__
        assert set(module.__all__) <= set(dir(module))
        with pytest.raises(AttributeError, match="no attribute 'stifness'"):
            _ = module.stifness


@pytest.mark.parametrize(
    "name",
    [
        "statics.cable_response",
        "analysis.cable_stiffness",
        "analysis.cable_tensions",
        "statics.equilibrium",
    ],
)
def test_a_module_does_not_hide_the_function_of_its_name(name: str):
    package, name = name.split(".")
    code = (
        f"import robostiff.{package}.{name}\n"
        f"from robostiff.{package} import {name} as function\n"
        f"import robostiff as rs; assert callable(function) and function is rs.{name}"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def loaded_by(code: str) -> list[str]:
    """Heavy packages that a fresh interpreter has loaded after the code."""
    code += f"\nimport sys; print(*(n for n in {HEAVY} if n in sys.modules))"
    finished = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True
    )
    return finished.stdout.split()
