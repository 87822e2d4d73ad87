"""What is installed with robostiff, and what works with that alone."""

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from functools import cache
from importlib.metadata import packages_distributions, requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from robostiff import extras
from tests.project.shown_output import ROOT

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]
FOR_DEVELOPERS = {"test", "peers", "lint", "bench", "docs"}
MOST_MEGABYTES = 300
INTERPRETERS = [f"python3.{minor}" for minor in (11, 12, 13, 14)]

WITHOUT_EXTRAS = """
import sys, warnings
from importlib import import_module
from pathlib import Path

sys.modules.update(dict.fromkeys({names}))  # None: cannot be imported
warnings.simplefilter("error")
import numpy as np
import robostiff as rs

robot = rs.load("hexapod")
assert rs.stiffness(robot).rank == 6
assert rs.indices(robot).result.rank == 6
assert rs.deflection(robot, wrench=[100, 0, 0, 0, 0, 0]).twist[0] > 0
assert rs.verify(robot).agree
assert str(rs.derive("planar-link").K)
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    compiled = rs.compile(robot)
(warning,) = caught
assert warning.category is rs.NoMachineCodeWarning and "'robostiff[fast]'" in str(warning.message)
pose = np.array([[0.01, 0.02, 0.9, 0, 0, 0.1]])
K = compiled.evaluate(pose).values["K"]
np.testing.assert_allclose(K, rs.stiffness(robot, pose).K, rtol=1e-9, atol=1e-3)
try:
    rs.compile(robot, backend=rs.Backend.MACHINE)
except rs.InputError as error:
    assert "'robostiff[fast]'" in str(error)
else:
    raise AssertionError

warnings.resetwarnings()
source = Path(rs.__file__).parent
for package in sorted(source.rglob("__init__.py")):
    module = import_module(".".join(("robostiff", *package.parent.relative_to(source).parts)))
    for name in getattr(module, "__all__", ()):
        assert getattr(module, name) is not None
"""


def bare(requirement: str) -> str:
    """Name of a distribution."""
    return (
        requirement.split(";", maxsplit=1)[0]
        .split(">", maxsplit=1)[0]
        .split("[", maxsplit=1)[0]
        .strip()
        .lower()
    )


def test_what_installs_robostiff():
    assert {bare(each) for each in PROJECT["dependencies"]} == {
        "numpy",
        "scipy",
        "sympy",
        "python-flint",
        "threadpoolctl",
        "pydantic",
        "pyyaml",
        "click",
        "rich",
    }
    assert [bare(each) for each in EXTRAS["fast"]] == ["llvmlite"]


def test_all_is_every_extra_for_users():
    (everything,) = EXTRAS["all"]
    listed = everything.removeprefix("robostiff[").removesuffix("]").split(",")
    assert set(listed) == set(EXTRAS) - FOR_DEVELOPERS - {"all"}


@pytest.mark.parametrize("extra", sorted(set(EXTRAS) - FOR_DEVELOPERS))
def test_extras_are_documented(extra: str):
    assert f"`{extra}`" in (ROOT / "docs/getting-started.md").read_text("utf-8")


def test_python_versions_are_listed():
    oldest = int(PROJECT["requires-python"].removeprefix(">=3."))
    listed = [f"python{each.rsplit(' ', 1)[1]}" for each in PROJECT["classifiers"] if "::" in each
              and each.startswith("Programming Language :: Python :: 3.")]  # fmt: skip
    assert listed == INTERPRETERS
    assert INTERPRETERS[0] == f"python3.{oldest}"


OTHERS = sorted(path.parent.name for path in ROOT.glob("extras/*/pyproject.toml"))


@pytest.mark.parametrize("name", OTHERS)
def test_other_distributions_are_documented_and_found_by_entry_points(name: str):
    assert f"| `./extras/{name}` |" in (ROOT / "docs/getting-started.md").read_text("utf-8")
    project = tomllib.loads((ROOT / "extras" / name / "pyproject.toml").read_text("utf-8"))
    groups = project["project"]["entry-points"]
    assert groups.keys() <= {extras.COMMANDS, extras.READERS, extras.WRITERS}
    for group, found in groups.items():
        for own in found:
            assert extras.is_offered(group, own)  # what to install is said where it is missing
            assert extras.load_extra(group, own) is not None
    assert (ROOT / "extras" / name / "LICENSE").read_text() == (ROOT / "LICENSE").read_text()


def test_a_group_that_nothing_adds_to_names_what_is_offered():
    assert not extras.is_offered(extras.COMMANDS, "opensees")
    assert not extras.is_offered(extras.WRITERS, "view")


def needed_by(requirements: Iterable[str]) -> set[str]:
    """Names of distributions, and of all that they need themselves."""
    found: set[str] = set()
    waiting = list(requirements)
    while waiting:
        requirement = Requirement(waiting.pop())
        name = canonicalize_name(requirement.name)
        if name not in found and (requirement.marker is None or requirement.marker.evaluate()):
            found.add(name)
            waiting += [one for one in requires(name) or () if "extra ==" not in one]
    return found


@cache
def beyond_what_is_needed() -> list[str]:
    """Packages that happen to be installed here, and robostiff does not ask for."""
    needed = needed_by([*PROJECT["dependencies"], "robostiff"])
    return sorted(
        package
        for package, owners in packages_distributions().items()
        if not needed & {canonicalize_name(owner) for owner in owners}
    )


def test_everything_but_extras_works_and_every_public_name_is_there_without_them():
    code = WITHOUT_EXTRAS.format(names=beyond_what_is_needed())
    subprocess.run([sys.executable, "-c", code], check=True)


#: What is missing for a command, and the extra that has it.
NEEDED = {
    "map hexapod --x '0 0.1 3' -o map.nc": ("maps", "maps"),
    "map hexapod --x '0 0.1 3' -o map.zarr": ("maps", "maps"),
    "plot hexapod -o picture.png": ("plots", "plot"),
    "report hexapod -o report.html": ("plots", "plot"),
    "modes hexapod --plot mode.png": ("plots", "plot"),
    "view hexapod": ("views", "robostiff-view"),
    f"check {ROOT}/examples/two-ur5.urdf.xacro": ("xacro files", "urdf"),
    f"check {ROOT}/examples/four-bar.xml": ("MJCF files", "robostiff-interop"),
    "convert hexapod --to opensees": ("models for OpenSees", "robostiff-interop"),
    "derive planar-link -o K.pdf": ("PDF files", "pdf"),
}
#: All in one process, which imports what they need once.
COMMANDS = """
import contextlib, importlib.metadata, io, json, sys

sys.modules.update(dict.fromkeys({names}))  # None: cannot be imported
importlib.metadata.entry_points = lambda group: ()
from robostiff.cli.main import main

found = []
for words in {commands}:
    sys.argv, out, err, code = ["robostiff", *words], io.StringIO(), io.StringIO(), None
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as ended:
            code = ended.code
    found.append((code, out.getvalue(), err.getvalue()))
print(json.dumps(found))
"""


def test_a_command_says_in_one_line_which_extra_it_needs(tmp_path):
    commands = [shlex.split(words) for words in NEEDED]
    code = COMMANDS.format(names=beyond_what_is_needed(), commands=commands)
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=tmp_path
    )
    for (what, extra), (code, out, error) in zip(
        NEEDED.values(), json.loads(done.stdout), strict=True
    ):
        assert (code, out) == (2, "")
        assert re.fullmatch(
            rf"robostiff: error: {what} need '[\w-]+', which is not installed; write pip install "
            rf"('robostiff\[{extra}\]'|\./extras/{extra} in a checkout of robostiff)\n",
            error,
        )
    assert not list(tmp_path.iterdir())


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    pip = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(folder), ROOT]
    if subprocess.run(pip, check=False, capture_output=True).returncode:
        pytest.skip("no index of packages can be reached")
    (found,) = folder.glob("robostiff-*.whl")
    return found


@pytest.mark.slow
@pytest.mark.parametrize("interpreter", INTERPRETERS)
def test_the_wheel_in_a_clean_environment(interpreter: str, wheel: Path, tmp_path: Path):
    python = shutil.which(interpreter)
    if python is None or subprocess.run([python, "-c", ""], check=False).returncode:
        pytest.skip(f"{interpreter} is not installed")
    subprocess.run([python, "-m", "venv", tmp_path / "clean"], check=True)
    own = next((tmp_path / "clean").glob("*/python"))
    install = ["-m", "pip", "install", "--quiet", "--only-binary", ":all:"]
    subprocess.run([own, *install, "-c", ROOT / "constraints.txt", wheel], check=True)
    clean = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = own.with_name("robostiff")
    for words in ("stiffness hexapod", "check 3-puu --json", "derive planar-link", "robots"):
        finished = subprocess.run(
            [command, *words.split()], check=True, env=clean, capture_output=True, cwd=tmp_path
        )
        assert finished.stdout
        assert not finished.stderr
    packages = next((tmp_path / "clean").rglob("site-packages"))
    others = {"pip", "setuptools", "pkg_resources"}
    size = 0  # of what the wheels hold, without the bytecode that Python adds
    for file in packages.rglob("*.*"):
        parts = file.relative_to(packages).parts
        if file.is_file() and "__pycache__" not in parts and parts[0].split("-")[0] not in others:
            size += file.stat().st_size
    assert size < MOST_MEGABYTES * 1e6
