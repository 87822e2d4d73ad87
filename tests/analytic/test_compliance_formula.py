"""Compliance as a formula, and chains from their compliance."""

import pytest
import sympy as sp

import robostiff as rs
from robostiff.analytic import Steps, compliance_formula, derive_chain
from robostiff.elasticity import cantilever_stiffness
from tests.analytic.formulas import CASE_A, CASE_B, L_A, L_B, stewart

L, E, G, A, I, J, k = sp.symbols("L E G A I J k", positive=True)
BEAM = sp.Matrix(cantilever_stiffness(L, E, G, A, I, I, J))


def test_deflection_of_a_cantilever():
    C = compliance_formula(BEAM)
    assert C[1, 1] == L**3 / (3 * E * I)
    assert C[5, 1] == L**2 / (2 * E * I)
    assert C[0, 0] == L / (E * A)
    assert C[3, 3] == L / (G * J)


def test_stiffness_and_compliance_are_inverse():
    K = stewart(*CASE_B, L_B)
    assert (K * compliance_formula(K)).applyfunc(sp.simplify) == sp.eye(6)


def test_a_free_motion_leaves_no_compliance():
    with pytest.raises(rs.InputError, match=r"rank 3 of 6.*free_motion_formulas"):
        compliance_formula(stewart(*CASE_A, L_A))


@pytest.mark.parametrize("form", [None, Steps()])
def test_a_chain_from_the_compliances_of_its_springs(form):
    C = compliance_formula(BEAM) + sp.diag(1 / k, 0, 0, 0, 0, 0)
    joints = {
        "Ry": [0, 0, 0, 0, 1, 0],
        "Rz": [0, 0, 0, 0, 0, 1],
        "Ry at the base": [0, 0, -L, 0, 1, 0],
    }
    options = {} if form is None else {"form": form}
    chain = derive_chain(C=C, joints=joints, **options)
    values = {"L": 0.5, "E": 2e11, "G": 8e10, "A": 1e-4, "I": 1e-9, "J": 2e-9, "k": 1e7}
    found = chain.substituted(values)
    assert float(found[0, 0]) == pytest.approx(1 / (1e-7 + 0.5 / 2e7))
    assert float(found[2, 2]) == 0
    stages = [stage.rule.split(":")[0] for stage in chain.stages]
    assert stages[0] == "rotation about y at the reference point"


def test_either_stiffness_or_compliance():
    for arguments in ({"joints": {}}, {"K0": BEAM, "C": BEAM, "joints": {}}, {"K0": BEAM}):
        with pytest.raises(rs.InputError, match="either K0 or C, and joints"):
            derive_chain(**arguments)
