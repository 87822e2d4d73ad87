"""Where a formula holds: in words for a reader, and as tests of a program."""

import robostiff as rs
from robostiff.analytic.export import c_function, derivation_text, python_function
from robostiff.analytic.export.program import program

BOX = """\
robostiff: 1
name: box
source: of this test
parameters: {b: 60 mm, t: 5 mm}
legs:
  - name: arm
    chain:
      - {type: beam, name: bar, to: [1, 0, 0], y_axis: y, material: steel,
         section: {box: {width_y: b, height_z: 40 mm, wall: t}}}
"""


def test_a_condition_that_all_legs_have_is_tested_once():
    derivation = rs.derive("3-rps")
    assert len(derivation.conditions) == 3
    (own,) = [x for x in program(derivation).conditions if "positive or zero" not in x[0]]
    assert own[0] == "a beam of a telescope of each leg has a positive length"
    for write in (python_function, c_function):
        assert "leg1" not in write(derivation)


def test_all_legs_are_not_listed():
    words = " ".join(derivation_text(rs.derive("hexapod")).split())
    assert "It holds only where the passive joints of each leg are independent." in words
    assert "positive where a beam of a telescope of each leg has a positive length" in words


def test_masses_are_no_condition_of_a_stiffness(tmp_path):
    file = tmp_path / "box.yaml"
    file.write_text(BOX, encoding="utf-8")
    words = [x.words for x in rs.derive(file).conditions]
    assert any(x.startswith("wall of the box") for x in words)
    assert not any("mass" in x for x in words)
