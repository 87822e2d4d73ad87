"""Numbers that commands answer are those of Python."""

# pyright: reportArgumentType=false

import shlex
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest

import robostiff as rs
from robostiff.robots import robot_file
from tests.cli.running import Running
from tests.io.test_springs_laws_and_masses import ARM
from tests.project.shown_output import ROOT

answer = Running().answer
PORTAL, PANTOGRAPH = str(ROOT / "examples/portal.json"), "double-pantograph"
HERE = [0.02, 0.01, 0.1]
load = cache(rs.load)


@cache
def other_posture(*pose: float) -> list[np.ndarray]:
    """Joint coordinates of the legs of a 3-RRR on the other side of all elbows."""
    return [own[-1].coordinates for own in rs.postures(load("3-rrr"), list(pose)).values()]


def near(*pose: float) -> str:
    return " ".join(f"{value:.17g}" for q in other_posture(*pose) for value in q)


def low(**parameters: float) -> Any:
    return rs.network_at(rs.load_linkage(PANTOGRAPH, parameters), {"screw": -0.05})


def of_hexapod_under_load() -> dict[str, Any]:
    options = {
        "at": [0, 0, 1],
        "gravity": "-z",
        "loads": {"leg1/strut": rs.Mass(12.0), "platform": rs.Mass(80.0), "leg2/strut": [0, 10, 0]},
        "preload": {"leg3/strut": 2000.0},
    }
    F = [0, 0, -5e4, 0, 0, 0]
    rest = rs.equilibrium(load("hexapod"), None, F, **options)
    critical = rs.critical_load(load("hexapod"), None, F, **options)
    assert len(rest.reactions) == 6
    return {
        "displacement": rest.displacement,
        "K_total": rest.K_total,
        "energy": rest.energy,
        "status": str(rest.status),
        "stable": True,
        "critical_load factor": critical.factor,
        "critical_load mode": critical.mode,
    }


def of_portal_under_loads() -> dict[str, Any]:
    bent = rs.network_response(
        load(PORTAL),
        {
            "beam": rs.DistributedForce([0, 0, -2000]),
            "left post": rs.ForceOnBeam([50, 0, 0], 0.2),
            "corner": [0, 0, 0, 0, 1, 0],
        },
        settlements={"right foot": [0, 0, -1e-3, 0, 0, np.deg2rad(1)]},
    )
    return {
        "displacements corner": bent.twists["corner"],
        "reactions 'left foot'": bent.reactions["left foot"],
        "beams beam end N": bent.beams["beam"].end[0],
        "energy": bent.energy,
    }


def of_arm_that_swings() -> dict[str, Any]:
    found = rs.modes(
        load("six-joint-arm"),
        masses={"platform": 8.0, "arm/joint3": 2.0},
        wrench=[0, 0, -150, 0, 0, 0],
        gravity="-z",
    )
    first = {"modes 0 frequency": found.frequencies[0], "modes 1 frequency": found.frequencies[1]}
    return {**first, "status": "ok", "modes 0 words": found[0].words}


def deflection(name: str, **load_: Any) -> dict[str, Any]:
    return {"deflection": rs.deflection(load(name), **load_).twist}


def stiffness(name: str, *pose: Any, **more: Any) -> dict[str, Any]:
    found = rs.stiffness(load(name), *pose, **more)
    return {
        "stiffness": found.K,
        "compliance": found.compliance,
        "pose": found.pose,
        "reference_point": found.reference_point,
        "order twist": list(found.space.twist_order),
    }


BODIES = {"leg1/strut": [0, 0, -80.0], "platform": rs.Mass(12.0)}
LOADS = "--load 'leg1/strut=0 0 -80 N' --weight 'platform=12 kg'"
CALLS: dict[str, Callable[[], dict[str, Any]]] = {
    "stiffness gough-stewart-b --at '0 0 1'": lambda: stiffness("gough-stewart-b", at=[0, 0, 1]),
    "stiffness gough-stewart-b --pose '10 mm 0 0.8 0 0 10 deg'": lambda: stiffness(
        "gough-stewart-b", [0.01, 0, 0.8, 0, 0, np.radians(10)]
    ),
    "stiffness gough-stewart-b --set 'k=2e8 N/m'": lambda: {
        "stiffness": 2 * stiffness("gough-stewart-b")["stiffness"]
    },
    "stiffness hexapod --pose 'tip 0 0 900 mm axis 0 0 1 spin 10 deg'": lambda: stiffness(
        "hexapod", [0, 0, 0.9, 0, 0, np.radians(10)]
    ),
    "stiffness hexapod --joints leg2/strut=0.3": lambda: stiffness(
        "hexapod", rs.ActuatorCoordinates({"leg2/strut": 0.3})
    ),
    "stiffness hexapod --joints '290 mm 290 mm 300 mm 290 mm .29 .295'": lambda: stiffness(
        "hexapod", rs.ActuatorCoordinates([0.29, 0.29, 0.3, 0.29, 0.29, 0.295])
    ),
    "stiffness 3-rrr --pose '0.02 0.01 0.1' --near NEAR": lambda: stiffness(
        "3-rrr", HERE, near=other_posture(*HERE)
    ),
    "stiffness double-pantograph --set k=1e5 --joints '-50 mm'": lambda: {
        "stiffness": rs.stiffness(low(k=1e5)).K,
        "joint_coordinates screw": [-0.05],
    },
    "deflection double-pantograph --joints 'screw=-50 mm' --wrench '0 0 -100 N 0 0 0'": lambda: {
        "deflection": rs.deflection(low(), wrench=[0, 0, -100, 0, 0, 0]).twist
    },
    f"deflection hexapod {LOADS}": lambda: deflection("hexapod", loads=BODIES),
    f"deflection hexapod {LOADS} --gravity=-y": lambda: deflection(
        "hexapod", loads=BODIES, gravity="-y"
    ),
    f"deflection hexapod {LOADS} --wrench '0 0 -100 N 0 0 0'": lambda: deflection(
        "hexapod", loads=BODIES, wrench=[0, 0, -100.0, 0, 0, 0]
    ),
    "deflection six-joint-arm --gravity=-z": lambda: deflection("six-joint-arm", gravity="-z"),
    "deflection six-joint-arm --gravity '0 0 -9.80665' --wrench 'Fz=-150 N, Mx = 0'": lambda: (
        deflection("six-joint-arm", gravity="-z", wrench=[0, 0, -150, 0, 0, 0])
    ),
    "equilibrium hexapod --wrench '0 0 -50 kN 0 0 0' --at '0 0 1' --gravity=-z --critical "
    "--weight 'leg1/strut=12 kg' --weight 'platform=80 kg' --load 'leg2/strut=0 10 N 0' "
    "--preload 'leg3/strut=2 kN'": of_hexapod_under_load,
    "equilibrium hexapod --preload 'leg[12]/strut=2 kN' "
    "--preload 'leg3/base joint*=1 N m'": lambda: {
        "displacement": rs.equilibrium(
            load("hexapod"),
            preload={
                **{"leg1/strut": 2e3, "leg2/strut": 2e3},
                **{"leg3/base joint[0]": 1.0, "leg3/base joint[1]": 1.0},
            },
        ).displacement
    },
    "equilibrium double-pantograph --wrench '100 50 -30 1 1 1' --preload 'screw=10 N'": lambda: {
        "displacement": rs.equilibrium(
            load(PANTOGRAPH), None, [100, 50, -30, 1, 1, 1], preload={"screw": 10.0}
        ).displacement
    },
    "equilibrium double-pantograph --joints 'screw=-50 mm' --wrench '0 0 -100 N 0 0 0'": lambda: {
        name: getattr(rs.equilibrium(low(), None, [0, 0, -100, 0, 0, 0]), name)
        for name in ("displacement", "K")
    },
    "modes six-joint-arm --mass 'platform=8 kg' --mass 'arm/joint3=2 kg' --gravity=-z "
    "--wrench '0 0 -150 N 0 0 0'": of_arm_that_swings,
    "modes double-pantograph --joints 'screw=-50 mm' --mass 'platform=20 kg'": lambda: {
        "modes 0 frequency": rs.modes(low(), masses={"platform": 20.0}).frequencies[0]
    },
    f"response {PORTAL} --along 'beam=0 0 -2 kN/m' --on 'left post=200 mm 50 N 0 0' "
    "--load 'corner=0 0 0 0 1 N m 0' --settle 'right foot=0 0 -1 mm 0 0 1 deg'": (
        of_portal_under_loads
    ),
    "indices gough-stewart-b --length '200 mm'": lambda: {
        "length": 0.2,
        "indices condition two_norm": rs.indices(
            rs.stiffness(load("gough-stewart-b")), length=0.2
        ).condition.two_norm,
        "indices eigenstiffness unit": "N/m",
        "indices principal units": ["N/m", "N m/rad"],
        "indices centre_of_stiffness status": "ok",
        "indices eigenscrews wrenches 0 screw pitch": 0.0,
    },
}


@pytest.mark.parametrize("call", CALLS)
def test_numbers_are_those_of_python(call):
    found = answer(*(near(*HERE) if word == "NEAR" else word for word in shlex.split(call)))
    for path, expected in CALLS[call]().items():
        own: Any = found
        for step in shlex.split(path):
            own = own[int(step) if isinstance(own, list) else step]
        if isinstance(np.ravel(expected)[0], str | np.bool):
            assert own == expected
        else:
            size = 1e-9 * np.abs(expected).max()
            np.testing.assert_allclose(own, expected, rtol=1e-9, atol=size, err_msg=path)


def test_options_that_choose_another_answer_do_so():
    """Another posture, joints away from home."""
    for away, home in (
        (
            f"stiffness 3-rrr --pose '0.02 0.01 0.1' --near '{near(*HERE)}'",
            "stiffness 3-rrr --pose '0.02 0.01 0.1'",
        ),
        ("stiffness double-pantograph --joints screw=-0.05", "stiffness double-pantograph"),
    ):
        K, other = (np.array(answer(*shlex.split(own))["stiffness"]) for own in (away, home))
        assert np.abs(K - other).max() > 1e-3 * np.abs(K).max()


def test_standard_input_takes_models_and_snapshots():
    snapshot = (ROOT / "tests/cases/data/a10_oblique_baseU_tipS.json").read_text()
    for text, rank in ((robot_file("gough-stewart-b").read_text(), 6), (snapshot, 1)):
        assert answer("stiffness", "-", stdin=text)["rank"] == rank


def test_springs_between_bodies_share_a_wrench(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")
    found = answer("deflection", str(path), "--wrench", "0 0 -100 N 0 0 0")["deflection"]
    arm, F = rs.load(path), [0, 0, -100, 0, 0, 0]
    np.testing.assert_allclose(found, rs.deflection(arm, wrench=F).twist)
    assert found[2] / rs.deflection(arm.with_springs(), wrench=F).twist[2] < 0.99


def test_an_index_that_is_unlimited_is_null_in_json_and_said_in_words():
    found = answer("indices", "gough-stewart-a")
    assert found["status"] == "free-motions"
    assert set(found["indices"]) == {
        *("along_axes", "principal", "collinear", "worst_deflection", "anisotropy", "eigenscrews"),
        *("centre_of_stiffness", "centre_of_compliance", "eigenstiffness", "condition"),
        "virtual_work",
    }
    assert found["indices"]["worst_deflection"]["translational"] is None
    text = Running("indices")("gough-stewart-a").stdout
    for words in ("moves freely", "centre of compliance: none", "free: rotation about x through"):
        assert words in text
