"""Materials: the moduli of the table, and what the lookup says when it finds nothing."""

import dataclasses

import numpy as np
import pytest

from robostiff.elasticity import MATERIALS, Material, material


def test_structural_steel_of_eurocode_3():
    steel = material("steel")
    assert steel.E == 210e9
    assert steel.G == pytest.approx(80.769e9, rel=1e-5)
    assert steel.poisson_ratio == pytest.approx(0.3, rel=1e-14)


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_has_a_source_and_sane_moduli(name):
    entry = MATERIALS[name]
    assert entry.name == name == name.lower()
    assert " " not in name
    assert len(entry.source) > 10
    assert 40e9 < entry.E < 250e9
    assert 0.2 < entry.poisson_ratio < 0.37


@pytest.mark.parametrize(
    ("name", "ksi_E", "ksi_G"),
    [
        ("aluminium-6061", 10.0e3, 3.8e3),
        ("aluminium-7075", 10.4e3, 3.9e3),
        ("titanium-6al-4v", 16.0e3, 6.2e3),
        ("magnesium-az31b", 6.5e3, 2.4e3),
        ("brass", 14.0e3, 5.3e3),
    ],
)
def test_handbook_values_in_inch_units(name, ksi_E, ksi_G):
    ksi = 6.894757e6
    assert material(name).E == pytest.approx(ksi_E * ksi, rel=6e-3)
    assert material(name).G == pytest.approx(ksi_G * ksi, rel=2e-2)


def test_the_table_cannot_be_changed():
    with pytest.raises(TypeError):
        MATERIALS["steel"] = Material("steel", 1.0, 1.0)  # type: ignore[index]
    with pytest.raises(dataclasses.FrozenInstanceError):
        material("steel").E = 1.0  # type: ignore[misc]


def test_numpy_numbers_become_floats():
    entry = Material("x", np.int64(2), np.float32(1.0))  # type: ignore[arg-type]
    assert type(entry.E) is float
    assert type(entry.G) is float


def test_poisson_ratio_returns():
    assert Material.isotropic("x", 3.0, -0.4).poisson_ratio == pytest.approx(-0.4, rel=1e-14)
