"""The response of a network to loads, as text and as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np

from robostiff.io.results.data import order
from robostiff.io.results.text import named
from robostiff.markup import number, text_of
from robostiff.network import Network, NetworkResponse
from robostiff.version import __version__

_SHOWN = 1e-9  # of the largest: smaller is rounding
_SECTION = ("N", "Vy", "Vz", "T", "My", "Mz")


def response_text(network: Network, result: NetworkResponse) -> str:
    """The result of `network_response`, as lines of text.

    Parameters
    ----------
    network : Network
    result : NetworkResponse
        Of it.
    """
    space, d = network.space, network.space.translations
    lines = [f"{network.name} under load", f"status: {result.status}", ""]
    lines.append("displacement of nodes [um, urad]:")
    twists = _without_rounding(result.twists, d)
    lines += [
        f"  {n}: {named(space.twist_order, 1e6 * t, 'um', 'urad')}" for n, t in twists.items()
    ]
    lines += [f"  {name}: can move freely" for name in result.free_nodes]
    lines += ["", "reaction of supports [N, N m]:"]
    reactions = _without_rounding(result.reactions, d)
    lines += [f"  {n}: {named(space.wrench_order, F, 'N', 'N m')}" for n, F in reactions.items()]
    left_out = [name for name in network.fixed if name not in reactions]
    lines += [f"  {name}: statically indeterminate" for name in left_out]
    if result.beams:
        lines += ["", "forces in beams, start and end [N, N m], N > 0 in tension:"]
        lines.append(" " * 24 + "".join(f"{name:>12}" for name in _SECTION))
    ends = {f"{n}, {end}": getattr(own, end) for n, own in result.beams.items() for end in _ENDS}
    for name, F in _without_rounding(ends, 3).items():
        lines.append(f"  {name:22}" + "".join(f"{number(x):>12}" for x in F))
    lines += ["", f"elastic energy {result.energy:.4g} J, by part:"]
    whole = sum(energy for *_, energy in result.loads.energies) or 1.0
    for before, after, energy in sorted(result.loads.energies, key=lambda part: -part[2])[:10]:
        name = after if before == "network" else f"{before}/{after}"
        lines.append(f"{100 * energy / whole:7.2f} %  {name}")
    return text_of(lines)


_ENDS = ("start", "end")


def _without_rounding(rows: dict[str, np.ndarray], split: int) -> dict[str, np.ndarray]:
    """Zero in place of what is rounding beside the largest of its kind."""
    if not rows:
        return {}
    every = np.abs(np.array(list(rows.values())))
    largest = np.empty(every.shape[1])
    largest[:split] = every[:, :split].max(initial=0.0)
    largest[split:] = every[:, split:].max(initial=0.0)
    return {n: np.where(np.abs(own) > _SHOWN * largest, own, 0.0) for n, own in rows.items()}


def response_data(network: Network, result: NetworkResponse) -> dict[str, Any]:
    """The result of `network_response`, as plain data.

    Parameters
    ----------
    network : Network
    result : NetworkResponse
        Of it.

    Returns
    -------
    dict
        JSON-ready; null where a displacement or reaction has no value.
    """
    names = [node.name for node in network.nodes]
    return {
        "network": network.name,
        "status": str(result.status),
        "order": order(network.space),
        "units": {"length": "m", "angle": "rad", "force": "N", "moment": "N m", "energy": "J"},
        "displacements": {n: _list(result.twists.get(n)) for n in names},
        "reactions": {n: _list(result.reactions.get(n)) for n in network.fixed},
        "beams": {
            n: {end: dict(zip(_SECTION, getattr(own, end).tolist(), strict=True)) for end in _ENDS}
            for n, own in result.beams.items()
        },
        "energies": [
            {"part": after, "of": before, "energy": energy}
            for before, after, energy in result.loads.energies
        ],
        "energy": result.energy,
        "robostiff": __version__,
    }


def _list(row: np.ndarray | None) -> list[float] | None:
    return None if row is None else row.tolist()
