"""Campaigns of the reference machines, and simulated ones."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import robostiff as rs

DATA = Path(__file__).parent / "data"
MARKS = ("a", "b", "c")


@cache
def case(name: str) -> dict:
    return json.loads((DATA / f"{name}.json").read_text("utf-8"))


def model_file(name: str, folder: Path) -> Path:
    file = folder / f"{name}.yaml"
    file.write_text(case(name)["arm_yaml" if name == "arm" else "model_yaml"], encoding="utf-8")
    return file


@cache
def machine(name: str) -> rs.Robot:
    """A reference machine, with what is kept with it: kernels are made once for all tests."""
    with TemporaryDirectory() as folder:
        return rs.load(model_file(name, Path(folder)))


def column(name: str, key: str) -> np.ndarray:
    return np.array(case(name)[key], dtype=float)


def arm_campaign(sigma: float | None = 2e-5, *, loads: tuple[int, ...] = (0, 1, 2), hooked=True):
    """Readings of the reference arm, under some of its three loads."""
    joints, forces = column("arm", "joint_coordinates"), column("arm", "dead_forces_at_hook")
    rows = [k for k in range(36) if (k // 3) % 3 in loads]
    whole = rs.Measurements(
        rs.JointCoordinates(np.repeat(joints, 9, axis=0)),
        column("arm", "measured"),
        forces=np.tile(np.repeat(forces, 3, axis=0), (4, 1)),
        hooks=column("arm", "hook_platform") if hooked else None,
        markers=MARKS * 12,
        sigma=sigma,
    )
    return whole.chosen(rows)


def arm_frames() -> rs.KnownFrames:
    known = case("arm")["known"]
    return rs.KnownFrames(dict(zip(MARKS, known["marks"], strict=True)), known["base"])


def hexapod_campaign() -> rs.Measurements:
    poses, wrenches = column("hexapod", "poses"), column("hexapod", "wrenches")
    return rs.Measurements(
        np.repeat(poses, 3, axis=0),
        column("hexapod", "measured").reshape(-1, 3),
        wrenches=np.repeat(wrenches, 3, axis=0),
        markers=MARKS * len(poses),
        sigma=column("hexapod", "sigma_xyz"),
        kinds=rs.Reading.DISPLACEMENT,
    )


def hexapod_frames() -> rs.KnownFrames:
    return rs.KnownFrames(dict(zip(MARKS, case("hexapod")["marks_platform"], strict=True)))


def with_values(measured: rs.Measurements, values: np.ndarray) -> rs.Measurements:
    return replace(measured, values=values)
