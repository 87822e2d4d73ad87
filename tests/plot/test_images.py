"""A few pictures look as they did when somebody looked at them.

``python -m tests.plot.test_images`` draws them again, to be looked at once more.
"""

from pathlib import Path
from typing import Any

import pytest
from matplotlib.testing.compare import compare_images

import robostiff as rs
from robostiff.plot import Matplotlib, Theme, Width
from tests.plot.machines import POSE, hexapod_deflection, hexapod_stiffness, robot, tripod_map

BASELINE = Path(__file__).parent / "baseline"
NARROW = Matplotlib(width=Width.HALF)
# Root mean square of colours, 0 to 255: other builds of the font renderer smooth edges otherwise.
TOLERANCE = 3.0

PICTURES = {
    "deformed-hexapod": lambda: rs.plot.robot(
        robot("hexapod"), POSE, deflection=hexapod_deflection(), backend=NARROW
    ),
    "matrix-on-dark": lambda: rs.plot.matrix(
        hexapod_stiffness(), backend=Matplotlib(width=Width.HALF, theme=Theme.DARK)
    ),
    "slice": lambda: rs.plot.map_slice(
        tripod_map(), "worst_deflection", x="x", y="y", at={"z": 0.3}, backend=NARROW
    ),
}


def save(name: str, path: Path) -> None:
    axes: Any = PICTURES[name]()
    axes.figure.savefig(path, dpi=80, metadata={"Software": None})


@pytest.mark.parametrize("name", PICTURES)
def test_picture_looks_as_it_did(name: str, tmp_path: Path):
    save(name, tmp_path / "now.png")
    difference = compare_images(str(BASELINE / f"{name}.png"), str(tmp_path / "now.png"), TOLERANCE)
    assert difference is None, difference


if __name__ == "__main__":
    for picture in PICTURES:
        save(picture, BASELINE / f"{picture}.png")
