"""Identification: a campaign of an arm with unknown frames, and one of a hexapod with 10,000 rows.

    python benchmarks/identification.py [--campaigns 2000]

With ``--campaigns`` so many simulated campaigns are fitted, and the share of true values in
intervals of 95 % is printed.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

import robostiff as rs
from robostiff.identification.identified import Identified
from robostiff.identification.search import fit

EXAMPLES = Path(__file__).parents[1] / "examples"


def arm() -> rs.Identified:
    """27 unknowns from 72 readings of three markers."""
    robot = rs.load(EXAMPLES / "loaded-arm.yaml")
    campaign = rs.Measurements.read(EXAMPLES / "campaign.csv", robot)
    asked = ["arm/joint*", "arm/joint*.zero"]
    return rs.identify(robot, campaign.chosen(range(72)), asked)


def hexapod(count: int) -> rs.Identified:
    """Compliances of six struts from displacements of three markers."""
    robot, random = rs.load("hexapod"), np.random.default_rng(3)
    marks = dict(zip("abc", 0.2 * np.eye(3), strict=True))
    poses = np.repeat(rs.random_postures(robot, count // 3), 3, axis=0)
    wrenches = random.uniform(-1, 1, (count // 3, 6)) * [2e3, 2e3, 2e3, 200, 200, 200]
    measured = rs.Measurements(
        poses,
        np.zeros((len(poses), 3)),
        wrenches=np.repeat(wrenches, 3, axis=0),
        markers=["a", "b", "c"] * (count // 3),
        kinds=rs.Reading.DISPLACEMENT,
        sigma=1e-6,
    )
    reached = rs.find_posture(robot, poses)
    measured = measured.chosen(reached.reached & reached.within_limits)
    found = rs.identify(robot, measured, ["leg*/strut"], frames=rs.KnownFrames(marks))
    exact = found.model.prediction(found.fit.start)[0].reshape(-1, 3)  # of nominal values
    return _simulated(found.fitted_to(replace(measured, values=exact)), random)


def _simulated(found: rs.Identified, random: np.random.Generator) -> rs.Identified:
    """The fit of other readings: those of the values of a fit, with errors."""
    exact, _ = found.predict(found.measured)
    values = exact + 1e-6 * random.standard_normal(exact.shape)
    return found.fitted_to(replace(found.measured, values=values))


def timed(found: rs.Identified) -> float:
    """Seconds of the processor of a fit whose kernel is compiled: the least of three."""
    seconds = []
    for _ in range(3):
        began = time.process_time()
        fit(replace(found.model), found.fit.start, found.fit.bounds, found.fit.loss)
        seconds.append(time.process_time() - began)
    return min(seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--campaigns", type=int, default=0)
    campaigns = parser.parse_args().campaigns
    if not campaigns:
        for name, make in (("arm", arm), ("hexapod", lambda: hexapod(10_000))):
            began = time.perf_counter()
            found = make()
            whole = time.perf_counter() - began
            print(
                f"{name}: {len(found.measured)} readings, {len(found.unknowns)} unknowns, "
                f"fit {timed(found):.2f} s, with its kernel {whole:.1f} s"
            )
        return
    found, random = hexapod(30), np.random.default_rng(11)
    truth, fit, inside = found.fit.x, found.fit, 0
    exact, _ = found.predict(found.measured)
    for k in range(1, campaigns + 1):
        values = exact + 1e-6 * random.standard_normal(exact.shape)
        model = replace(found.model, measured=replace(found.measured, values=values))
        own = Identified(*fit(model, truth, fit.bounds, fit.loss)).interval(0.95)
        inside += sum(a <= x <= b for x, (a, b) in zip(truth, own.values(), strict=True))
        if k % 500 == 0 or k == campaigns:
            print(
                f"{k} campaigns: {inside / (len(truth) * k):.2%} in intervals of 95 %", flush=True
            )


if __name__ == "__main__":
    main()
