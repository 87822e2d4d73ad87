"""What a person sees on a terminal."""

import io

import pytest
from rich.console import Console

import robostiff as rs
from robostiff.cli import tables


@pytest.fixture
def screen(monkeypatch):
    output = io.StringIO()

    def console(**options):
        return Console(file=output, width=80, force_terminal=False, **options)

    monkeypatch.setattr(tables, "Console", console)
    return output


def test_stiffness_fits_eighty_columns_with_all_numbers(screen):
    tables.print_stiffness(rs.stiffness(rs.load("3-puu"), [0.08, 0.05, 0.25]))
    shown = screen.getvalue()
    assert max(len(line) for line in shown.splitlines()) <= 80
    assert "…" not in shown
    assert shown.count("e+") + shown.count("e-") >= 20
    assert "rank 6 of 6" in shown


def test_free_motions_and_advice_are_shown(screen):
    tables.print_stiffness(rs.stiffness(rs.load("gough-stewart-a")))
    shown = screen.getvalue()
    assert "free: rotation about z through (0, 0, 2) m" in shown
    assert "advice: the platform can move" in shown


def test_deflection_lists_parts_and_actuators(screen):
    bent = rs.deflection(rs.load("hexapod"), wrench=[200, 0, -500, 0, 10, 0])
    tables.print_deflection(bent)
    shown = screen.getvalue()
    assert "18 more parts" in shown
    assert "load on the actuators" in shown
    assert "leg1/strut" in shown


def test_unreachable_pose_shows_no_matrix(screen):
    tables.print_stiffness(rs.stiffness(rs.load("3-puu"), [0.8, 0, 0.3]))
    shown = screen.getvalue()
    assert "K_C" not in shown
    assert "falls short" in shown
