"""Other programs that the tests compare with, or that run what is written for them.

A test that cannot do without says so by a mark, ``@pytest.mark.needs("Octave")``. Where the program
is not there the test is left out, and the summary of pytest says so once.
"""

import shutil
import sysconfig
from functools import cache
from importlib.util import find_spec
from pathlib import Path

# Packages of the extra `peers`, together some 1.5 GB: `make peers` installs them and runs what
# needs them.
PEERS = {
    *("example-robot-data", "llvmlite", "OpenSees", "pinocchio", "Playwright", "sectionproperties")
}
ROBOTS = Path(sysconfig.get_path("purelib")) / "cmeel.prefix/share/example-robot-data/robots"
_MODULES = {"NVRTC": "nvidia.cuda_nvrtc", "OpenSees": "openseespy", "Playwright": "playwright"}
COMMANDS = {
    "a C compiler": ("cc", "gcc", "clang"),
    "CalculiX": ("ccx",),
    "Chromium": ("chromium", "chromium-browser"),
    "LaTeX": ("pdflatex",),
    "Octave": ("octave-cli",),
}


def command(name: str) -> str:
    """The path of a program that is there."""
    found = next(filter(None, map(shutil.which, COMMANDS[name])), None)
    assert found is not None, f"{name} is not there: mark the test with needs({name!r})"
    return found


@cache
def is_there(name: str) -> bool:
    """Whether a program of this list is installed."""
    if name == "example-robot-data":
        return ROBOTS.exists()
    if name in COMMANDS:
        return any(map(shutil.which, COMMANDS[name]))
    module = _MODULES.get(name, name)
    return find_spec(module.partition(".")[0]) is not None and find_spec(module) is not None
