"""Defects that are planted one at a time: the campaign finds each."""

import warnings
from pathlib import Path

import pytest

from tests.campaign.plants import MACHINES, PLANTS, found


def test_there_are_twenty_defects_in_all_layers():
    assert len({plant.name for plant in PLANTS}) >= 20
    assert {plant.machines for plant in PLANTS} <= set(MACHINES)


def test_the_page_lists_them():
    page = (Path(__file__).parent / "README.md").read_text(encoding="utf-8")
    assert not [
        plant.name for plant in PLANTS if f"| {plant.name} | {plant.machines} |" not in page
    ]


@pytest.mark.slow
@pytest.mark.parametrize("plant", PLANTS, ids=lambda own: own.name)
def test_a_planted_defect_is_found(plant):
    machine = found(plant)
    assert machine is not None, f"{plant.most} {plant.machines}, and nothing was said"
    print(f"no. {machine[0]} of {plant.machines}: {machine[1]}")


def test_nothing_is_left_of_a_defect():
    plant = next(own for own in PLANTS if "Timoshenko" in own.name)
    judged = MACHINES[plant.machines]
    number, complaint = found(plant) or (0, None)
    assert complaint is not None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert not judged(number)
