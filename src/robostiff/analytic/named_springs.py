"""Names in place of the numbers of beams: of materials, and of E A, E I and G J of each beam."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import count
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Definition
from robostiff.analytic.operation_count import count_of
from robostiff.elasticity import (
    CrossSection,
    Elasticity,
    Material,
    SlenderBeam,
    cantilever_compliance,
)
from robostiff.model import Chain, Link, ParallelBlock, Robot, Telescope, TelescopicBeam
from robostiff.spatial import exact_number

#: Operations of a stiffness that needs no name, such as E*A.
SHORT = 1
#: Letters of the stiffnesses of a beam.
LETTERS = ("EA", "EI", "EI_y", "EI_z", "GJ")


def with_named_springs(robot: Robot, taken: Iterable[str]) -> tuple[Robot, tuple[Definition, ...]]:
    """The robot with names for the stiffnesses of its beams, and what the names stand for.

    A modulus that is a number has a name of its own where the section has symbols. Beams in which
    shear counts, tapered ones and given matrices stay as they are.

    `taken`: names that stand for something else.

    Examples
    --------
    >>> from robostiff.robots import load
    >>> symbols = ("b", "h", "l1", "l2")
    >>> _, names = with_named_springs(load("two-link-arm", symbols=symbols), symbols)
    >>> [str(d.symbol) for d in names]
    ['E', 'G', 'EA_1', 'EI_y_1', 'EI_z_1', 'GJ_1', 'EA_2', 'EI_2', 'GJ_2']
    >>> names[0].expression, names[3].expression
    (210000000000, E*b*h**3/12)
    """
    beams: list[tuple[str, SlenderBeam]] = []
    _changed(robot, lambda *own: beams.append(own))
    if not beams:
        return robot, ()
    table = _Table({*taken})
    table.name_moduli([beam for _, beam in beams])
    for name, beam in beams:
        table.name_products(name, beam)
    return _changed(robot, lambda _, beam: table.known[beam]), table.definitions


@dataclass(frozen=True)
class _Stiffnesses:
    """E A, E I_y, E I_z and G J of a beam, each a name, or a formula that needs none."""

    EA: Any
    EI_y: Any
    EI_z: Any
    GJ: Any

    def elasticity(self, own: Elasticity, length: Any) -> Elasticity:
        """That of a beam of some length."""
        products = self.EA, self.EI_y, self.EI_z, self.GJ
        C = cantilever_compliance(exact_number(length), 1, 1, *products)
        return replace(own, compliance=C, beam=None)

    def telescopic(self, beam: TelescopicBeam) -> TelescopicBeam:
        """A beam of a telescope that has them: products in place of a section, and moduli of 1."""
        section = CrossSection(self.EA, self.EI_y, self.EI_z, self.GJ)
        return replace(beam, material=Material(beam.material.name, 1, 1), section=section)


_Named = Callable[[str, SlenderBeam], _Stiffnesses | None]


class _Table:
    """Names of materials and of beams; those that are alike have one."""

    def __init__(self, taken: set[str]) -> None:
        self.known: dict[SlenderBeam, _Stiffnesses] = {}
        self._taken = taken
        self._moduli: dict[tuple[str, Any], Any] = {}
        self._sets: dict[tuple[Any, ...], _Stiffnesses] = {}
        self._definitions: dict[Any, Definition] = {}

    @property
    def definitions(self) -> tuple[Definition, ...]:
        """What the names stand for, in the order in which it can be computed."""
        return tuple(self._definitions.values())

    def name_moduli(self, beams: Iterable[SlenderBeam]) -> None:
        """Names for the moduli of materials that are numbers beside symbols."""
        found: dict[tuple[Any, Any, str], set[str]] = {}
        for beam in beams:
            E, G = map(exact_number, (beam.E, beam.G))
            needed = found.setdefault((E, G, beam.material), set())
            if not E.free_symbols and any(map(_has_symbols, (beam.A, beam.Iy, beam.Iz))):
                needed.add("E")
            if not G.free_symbols and _has_symbols(beam.J):
                needed.add("G")
        found = {own: needed for own, needed in found.items() if needed}
        is_one = len(found) == 1 and not self._taken & {"E", "G"}
        for E, G, material in found:
            number = None if is_one else self._number(("E", "G"))
            for letter, value in (("E", E), ("G", G)):
                if letter in found[E, G, material]:
                    name = letter if is_one else f"{letter}_{number}"
                    self._moduli[letter, value, material] = self._define(name, value, material)

    def name_products(self, name: str, beam: SlenderBeam) -> None:
        """Names for the products of a beam that are no short formulas."""
        E, G, A, Iy, Iz, J = map(exact_number, (beam.E, beam.G, beam.A, beam.Iy, beam.Iz, beam.J))

        def product(letter: str, modulus: Any, section: Any) -> Any:
            own = self._moduli.get((letter, modulus, beam.material), modulus)
            return (own if section.free_symbols else modulus) * section

        EA, EI_y, EI_z = (product("E", E, x) for x in (A, Iy, Iz))
        written = {"EA": EA, "EI_y": EI_y, "EI_z": EI_z, "GJ": product("G", G, J)}
        key = tuple(written.values())
        if key not in self._sets:
            self._sets[key] = self._named(written)
        self.known[beam] = found = self._sets[key]
        for symbol in (found.EA, found.EI_y, found.EI_z, found.GJ):
            own = self._definitions.get(symbol)
            if own is not None and name not in own.parts:
                self._definitions[symbol] = replace(own, parts=(*own.parts, name))

    def _named(self, written: dict[str, Any]) -> _Stiffnesses:
        number = self._number(LETTERS)
        alike = written["EI_y"] == written["EI_z"]
        named: dict[str, Any] = {}
        for letter, expression in written.items():
            own = "EI" if alike and letter.startswith("EI") else letter
            short = expression.free_symbols and count_of(expression) <= SHORT
            named[letter] = expression if short else self._define(f"{own}_{number}", expression)
        return _Stiffnesses(**named)

    def _define(self, name: str, expression: Any, *parts: str) -> Any:
        symbol = sp.Symbol(name, positive=True)
        self._definitions.setdefault(symbol, Definition(symbol, expression, parts))
        return symbol

    def _number(self, letters: Iterable[str]) -> int:
        """The first number with which no letter stands for something else."""
        names = ({f"{x}_{number}" for x in letters} for number in count(1))
        own = next(own for own in names if not own & self._taken)
        self._taken |= own
        return int(min(own).rpartition("_")[2])


def _has_symbols(value: Any) -> bool:
    return bool(exact_number(value).free_symbols)


def _changed(robot: Robot, named: _Named) -> Robot:
    """A robot with named stiffnesses in place of those of its beams, where they have names."""
    chains: dict[int, Chain] = {}
    legs = []
    for leg in robot.legs:
        if id(leg.chain) not in chains:
            chains[id(leg.chain)] = _chain(leg.chain, "", named)
        legs.append(replace(leg, chain=chains[id(leg.chain)]))
    platform = robot.platform
    if platform is not None:
        parts = (
            replace(x, elasticity=_elasticity(x.elasticity, f"platform/{x.name}", named))
            for x in platform.parts
        )
        platform = replace(platform, parts=tuple(parts))
    return replace(robot, legs=tuple(legs), platform=platform)


def _chain(chain: Chain, prefix: str, named: _Named) -> Chain:
    return replace(chain, elements=tuple(_element(x, prefix, named) for x in chain.elements))


def _element(element: Any, prefix: str, named: _Named) -> Any:
    name = prefix + getattr(element, "name", "")
    if isinstance(element, Link):
        return replace(element, elasticity=_elasticity(element.elasticity, name, named))
    if isinstance(element, Telescope):
        several = len(element.beams) > 1
        beams = (
            _telescopic(beam, f"{name}.beam{i}" if several else f"{name}.beam", named)
            for i, beam in enumerate(element.beams, start=1)
        )
        return replace(element, beams=tuple(beams))
    if isinstance(element, ParallelBlock):
        branches = (
            replace(own, chain=_chain(own.chain, f"{name}/{own.name}/", named))
            for own in element.branches
        )
        return replace(element, branches=tuple(branches))
    return element


def _elasticity(own: Elasticity, name: str, named: _Named) -> Elasticity:
    found = None if own.beam is None else named(name, own.beam)
    return own if found is None or own.beam is None else found.elasticity(own, own.beam.length)


def _telescopic(beam: TelescopicBeam, name: str, named: _Named) -> TelescopicBeam:
    own = SlenderBeam.of(1, beam.material, beam.section, beam.theory)
    found = None if own is None else named(name, own)
    return beam if found is None else found.telescopic(beam)
