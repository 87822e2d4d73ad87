"""Networks written for CalculiX, a finite element program, against our own compliance.

CalculiX prints seven digits.
"""

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from robostiff import compliance, load
from robostiff.cli.main import app
from robostiff.elasticity import Elasticity
from robostiff.network import JointElement, Network, SpringElement, beam_between
from robostiff_interop import calculix_input
from tests.cases.metric import distance
from tests.network.frames import BAR, STEEL, ball, nodes, turning
from tests.other_programs import command

_PORTAL = str(Path(__file__).parents[2] / "examples" / "portal.json")
_WRIST = str(Path(__file__).parents[2] / "examples" / "bevel-wrist.yaml")
_ROW = re.compile(r"^ +[12] +(\S+) +(\S+) +(\S+)$", re.MULTILINE)


def twists_at(path: Path) -> np.ndarray:
    """What an input file prints of its nodes 1 and 2, a row a load (m, 6)."""
    words = [command("CalculiX"), path.stem]
    done = subprocess.run(
        words, cwd=path.parent, capture_output=True, text=True, timeout=120, check=False
    )
    printed = path.with_suffix(".dat").read_text()
    twists = np.array([[float(x) for x in row] for row in _ROW.findall(printed)]).reshape(-1, 6)
    assert len(twists) > 0, done.stdout[-500:]
    return twists


def by_calculix(path: Path, rows: list[int]) -> np.ndarray:
    """Compliance of an input file (n, n)."""
    twists = twists_at(path)
    assert len(twists) == len(rows)
    return twists[:, rows].T


@pytest.mark.needs("CalculiX")
@pytest.mark.parametrize(
    "name",
    [pytest.param(_PORTAL, id="portal"), pytest.param(_WRIST, id="coupled joints"), "3-rrr",
     "hexapod", "orthoglide"],
)  # fmt: skip
def test_written_models_have_our_compliance(name, tmp_path):
    path = tmp_path / "model.inp"
    shown = CliRunner().invoke(app, ["convert", name, "--to", "calculix", "-o", str(path)])
    assert shown.exit_code == 0
    robot = load(name)
    assert distance(by_calculix(path, list(robot.space.rows)), compliance(robot)) < 1e-6


@pytest.mark.needs("CalculiX")
def test_loops_redundant_constraints_and_a_rod_that_spins(tmp_path):
    """A door on two rigid hinges, held by a spring of a full matrix and by a rod on ball joints."""
    wall, door, low, high = nodes(wall=[0, 0, 0], door=[0.5, 0, 1], low=[1, 1, 0], high=[1, 0, 1])
    hinges = tuple(
        JointElement(f"hinge {z}", "wall", "door", (turning([0, 0, z], [0, 0, 1]),)) for z in (0, 2)
    )
    ends = (
        JointElement("low ball", "wall", "low", ball(low.point)),
        JointElement("high ball", "door", "high", ball(high.point)),
    )
    rod = beam_between(low, high, STEEL, BAR, name="rod")
    A = np.random.default_rng(4).normal(size=(6, 6))
    spring = SpringElement(
        "closer", "wall", "handle", np.array([0.2, 0.1, 1]), np.eye(3), Elasticity(1e-6 * A @ A.T)
    )
    (handle,) = nodes(handle=[1, 0.1, 1.1])
    arm = beam_between(door, handle, STEEL, BAR, name="arm")
    network = Network(
        "door", (wall, door, low, high, handle), ("wall",), "handle", handle.point,
        beams=(rod, arm), springs=(spring,), joints=(*hinges, *ends),
    )  # fmt: skip
    path = tmp_path / "door.inp"
    path.write_text(calculix_input(network))
    assert distance(by_calculix(path, list(range(6))), compliance(network)) < 1e-6


def test_what_calculix_reads_is_twenty_characters_wide():
    network = load(_PORTAL)
    numbers = re.findall(r"-?\d\.\d+e[-+]\d+", calculix_input(network))
    assert len(numbers) > 100
    assert max(map(len, numbers)) <= 20
