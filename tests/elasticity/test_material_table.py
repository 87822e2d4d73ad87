"""Materials: the moduli of the table, and what the lookup says when it finds nothing."""

import dataclasses

import numpy as np
import pytest

from robostiff.elasticity import MATERIALS, Material, material
from robostiff.errors import InputError


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


def test_unknown_name_gets_the_nearest_and_all():
    with pytest.raises(InputError) as error:
        material("aluminum 6061")
    message = str(error.value)
    assert message.startswith("material: got 'aluminum 6061', expected one of steel, ")
    assert "did you mean 'aluminium-6061'?" in message
    assert "Material.isotropic(name, E, poisson_ratio, source)" in message
    assert all(name in message for name in MATERIALS)


@pytest.mark.parametrize("name", ["wood", "", 7, None])
def test_unknown_name_without_a_near_one(name):
    with pytest.raises(InputError) as error:
        material(name)
    assert "did you mean" not in str(error.value)


@pytest.mark.parametrize("E", [0.0, -1.0, np.nan, np.inf, "210e9", None, True, 1j])
def test_modulus_must_be_positive(E):
    with pytest.raises(InputError, match=r"Young's modulus E of 'x': .*a positive finite number"):
        Material("x", E, 1e9)
    with pytest.raises(InputError, match=r"shear modulus G of 'x': .*a positive finite number"):
        Material("x", 1e9, E)
    with pytest.raises(InputError, match="Young's modulus E of 'x'"):
        Material.isotropic("x", E, 0.3)


def test_message_of_a_bad_modulus():
    with pytest.raises(InputError) as error:
        Material("PEEK", -3.7e9, 1.3e9)
    assert str(error.value) == (
        "Young's modulus E of 'PEEK': got -3700000000.0, expected a positive finite number [Pa]"
    )


@pytest.mark.parametrize("nu", [-1.0, 0.5, 30, np.nan, "0.3", None])
def test_poisson_ratio_bounds(nu):
    with pytest.raises(InputError) as error:
        Material.isotropic("x", 1e9, nu)
    assert str(error.value) == (
        f"Poisson ratio: {'' if nu is None else f'got {nu!r}, '}expected a number between -1 and "
        "0.5, both excluded (isotropic material); any other material is written by its moduli: "
        "Material(name, E, G, source)"
    )


def test_poisson_ratio_returns():
    assert Material.isotropic("x", 3.0, -0.4).poisson_ratio == pytest.approx(-0.4, rel=1e-14)
