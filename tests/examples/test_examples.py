"""The examples of the gallery run, warn of nothing, and give the answers that their pages claim."""

import re
import runpy
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

from tests.project.shown_output import ROOT
from tests.robots.test_architectures import both

FOLDER = ROOT / "examples"
EXAMPLES = sorted(FOLDER.glob("*.py"))


class Page:
    """An example that was run: its text, what it printed, and its names."""

    def __init__(self, path: Path, printed: str, names: dict[str, Any]) -> None:
        self.text = " ".join(path.read_text(encoding="utf-8").replace("\n#", "\n").split())
        self.printed = printed
        self.names = names

    def claims(self, words: str) -> bool:
        """Whether the page says so, however its lines are broken."""
        return words in self.text


@pytest.fixture
def page(request: pytest.FixtureRequest, capsys: Any, monkeypatch: pytest.MonkeyPatch):
    """The example whose name is the parameter, run as a script in a folder of its own."""
    monkeypatch.setenv("MPLBACKEND", "agg")
    monkeypatch.chdir(request.getfixturevalue("tmp_path"))
    path = FOLDER / f"{request.param}.py"
    monkeypatch.setattr(sys, "argv", [str(path)])
    names = runpy.run_path(str(path), run_name="__main__")
    from matplotlib import pyplot as plt

    plt.close("all")
    return Page(path, capsys.readouterr().out, names)


def of(name: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("page", [name], indirect=True, ids=[name])


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_begins_with_a_question_and_ends_with_an_answer(path: Path):
    text = path.read_text(encoding="utf-8")
    title, line = text.splitlines()[1:3]
    assert line == "=" * len(title)
    assert re.search(r'"""\n.*\n=+\n\n\*\*[^*]+\?\*\*', text)
    assert "\n# **Answer:**" in text


def test_every_example_has_its_place_in_the_gallery_and_a_test():
    listed = (ROOT / "docs/_ext/pictures_of_examples.py").read_text(encoding="utf-8")
    tested = Path(__file__).read_text(encoding="utf-8")
    for path in EXAMPLES:
        assert f'"{path.name}"' in listed
        assert f'@of("{path.stem}")' in tested


@of("three_free_rotations_of_a_hexapod")
def test_hexapod_turns_about_its_apex(page: Page):
    lines = page.printed.splitlines()
    assert lines[0] == "rank 3 of 6, status free-motions"
    assert lines[1:4] == [f"rotation about {axis} through (0, 0, 2) m" for axis in "xyz"]
    assert "rank 3 for all dimensions; apex at [0, 0, h*r/(R - r)]" in lines
    height = page.names["apex"][2]
    sizes = {"R": 0.5, "r": 0.3, "h": 0.8}
    assert float(height.subs({s: sizes[s.name] for s in height.free_symbols})) == pytest.approx(1.2)
    assert page.claims("= 1.2 m above the platform")
    assert lines[-4:] == [
        "100 N down:     free-motions",
        "100 N sideways: free-motions+unbalanced",
        "gough-stewart-a: rank 5 to 5",
        "gough-stewart-b: rank 6 to 6",
    ]


@of("how_stiff_for_how_much_mass")
def test_a_wider_base_buys_what_half_the_mass_more_does(page: Page):
    masses, small, large = (page.names[name] for name in ("masses", "small", "large"))
    for front in (small, large):
        np.testing.assert_allclose(front * masses, front[0] * masses[0], rtol=2e-3)
    assert page.printed.count("optimum") == 2 * len(masses)
    np.testing.assert_allclose(large / small, 1 - 0.28, atol=0.005)
    assert page.claims("28 % less")
    assert small[0] * masses[0] < page.names["mass"] * page.names["deflection"]


@of("stiffer_screws_or_stiffer_joints")
def test_stiffer_screws_gain_more(page: Page):
    shares, now, bent = (page.names[name] for name in ("shares", "now", "bent"))
    assert sum(shares.values()) == pytest.approx(1)
    for kind, answer in bent.items():
        assert answer.energy / now.energy == pytest.approx(1 - shares[kind] / 2, rel=1e-9)
    assert [round(100 * shares[kind]) for kind in ("screws", "bearings")] == [54, 32]
    assert page.claims("store 54 % of the energy, so screws that are twice as stiff reduce the")
    assert page.claims("deflection by 27 %, bearings by 16 %")
    principal = {
        kind: np.linalg.eigvalsh(np.stack([one.K[:3, :3], one.K[3:, 3:]]))
        for kind, one in page.names["stiffness"].items()
    }
    np.testing.assert_allclose(principal["screws"] / principal["bearings"], 1.15, atol=0.006)
    assert page.claims("by 15 % in each of them")


@of("how_much_a_hexapod_carries")
def test_slender_tubes_buckle_and_vibrate_slowly_before(page: Page):
    found, sooner, euler = (page.names[name] for name in ("found", "sooner", "euler"))
    assert page.names["carried"] / euler == pytest.approx(1, abs=1e-3)
    assert page.claims(f"{found.factor:.0f} kN straight down, and {sooner.factor:.0f} kN if")
    pairs = re.findall(r"(\d+)% of the critical load: ([\d.]+) Hz", page.printed)
    shares, hertz = np.array(pairs, dtype=float).T
    left = np.sqrt(1 - shares / 100)
    np.testing.assert_allclose(hertz, hertz[0] * left, rtol=0.01)
    assert np.abs(page.names["change"]).max() < 0.01
    assert page.claims("deflection does not announce it, but the vibrations of the tubes do")


@of("where_a_delta_robot_is_stiff")
def test_delta_robot_is_stiffest_high_up(page: Page):
    middle = [float(found) for found in re.findall(r"([\d.]+) um/N in the middle", page.printed)]
    assert middle == sorted(middle)
    assert page.claims(f"worst deflection is {middle[0]} µm/N at 500 mm below")
    assert page.claims(f"and {middle[-1]} µm/N at 900 mm")
    assert len(re.findall(r"8\d% of the energy in the motors", page.printed)) == 2


@of("orthoglide_against_3_puu")
def test_parallelograms_hold_torques(page: Page):
    home = next(line for line in page.printed.splitlines() if line.strip().startswith("0 mm"))
    *_, least, _, most, _ = home.split()
    assert least == most
    assert page.claims(f"a factor of {least} against torques")
    assert least == "131"
    found = page.names["table"]
    np.testing.assert_allclose(found["held"][0], found["held"][1], rtol=1e-9)
    assert (found["alone"][1] <= found["alone"][0] * (1 + 1e-9)).all()
    C, C_other = (np.linalg.inv(K)[:, 3:, 3:] for K in both())
    axes = np.random.default_rng(1).normal(size=(50, 3))
    turned = [np.einsum("ai,nij,aj->na", axes, block, axes) for block in (C, C_other)]
    factors = turned[1] / turned[0]
    assert (found["factors"].min(axis=1, keepdims=True) <= factors * (1 + 1e-9)).all()
    assert (found["factors"].max(axis=1, keepdims=True) >= factors * (1 - 1e-9)).all()
    assert found["factors"].min() == pytest.approx(13.7, abs=0.1)
    assert found["factors"].max() == pytest.approx(289, abs=1)


@of("zeroing_rows_is_wrong")
def test_zeroing_rows_is_too_stiff_by_four(page: Page):
    steel, section = page.names["steel"], page.names["section"]
    right, shortcut = page.names["right"][1, 1], page.names["shortcut"][1, 1]
    assert right == pytest.approx(3 * steel.E * section.Iz / 0.5**3)
    assert shortcut == pytest.approx(4 * right)
    assert page.claims("158 instead of 40 N/mm")
    assert (round(shortcut / 1e3), round(right / 1e3)) == (158, 40)
    np.testing.assert_allclose(page.names["factors"][[0, 2, 5]], [4, 1, 4])

    table = (ROOT / "docs/why-zeroing-rows-is-wrong.md").read_text(encoding="utf-8")
    for matrix in ("table", "wrong"):
        K = page.names[matrix]
        for shown in (
            f"{K[0, 0] / 1e3:.0f} N/mm",
            f"{K[2, 2] / 1e6:.0f} N/µm",
            f"{K[5, 5] / 1e3:#.3g} kN m/rad",
        ):
            assert f"| {shown} |" in table


@of("redundant_joints_break_the_inverse")
def test_inverse_is_wrong_wherever_it_answers(page: Page):
    np.testing.assert_allclose(page.names["ours"], 1, rtol=1e-11)
    assert {int(answer.rank) for answer in page.names["answers"]} == {1}
    assert "free-motions+redundant-joints" in page.printed
    # How many are noticed depends on the processor; that the rest is not right does not.
    theirs = page.names["theirs"][page.names["found"]]
    assert np.mean(np.abs(theirs - 1) > 0.01) > 0.9


@of("closed_form_of_a_new_robot")
def test_closed_form_is_that_of_the_page(page: Page):
    R, r, a, k = (sp.Symbol(name, positive=True) for name in "Rrak")
    K = page.names["derivation"].K
    expected = sp.diag(*[3 * k / 2 * (1 + (R - r) ** 2 / a**2)] * 2, 3 * k * r**2)
    assert (K - expected).applyfunc(sp.simplify).is_zero_matrix
    assert page.claims(r"\frac{3k}{2}\left(1 + \frac{(R - r)^2}{a^2}\right)")
    assert page.claims("1.5 k (1 + (R - r)²/a²) for horizontal forces, and 3 k r² for rotation")
    np.testing.assert_allclose(page.names["formula"], page.names["numbers"], rtol=1e-9, atol=1e-3)
    assert page.printed.endswith("at a = 80 mm: 217.5 N/um sideways, 600 kN m/rad\n")
