"""Names in place of the numbers of springs: moduli, E A, E I and G J of beams, drives.

Each has its value in the nomenclature.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import count
from typing import Any

import numpy as np
import sympy as sp

from robostiff.analytic.exact.definition import Definition, count_of
from robostiff.analytic.exact.exact_points import values_of
from robostiff.elasticity import (
    CrossSection,
    Elasticity,
    Material,
    SlenderBeam,
    cantilever_compliance,
)
from robostiff.frozen import frozen, replace
from robostiff.model import Chain, ParallelBlock, Robot, StiffnessLaw, TelescopicBeam
from robostiff.spatial import Screw, exact_number

_SHORT = 1  # operations of a stiffness that needs no name, such as E*A
# Letters of the stiffnesses of a beam.
_LETTERS = ("EA", "EI", "EI_y", "EI_z", "GJ")


def with_samples(
    springs: Sequence[Definition], samples: Mapping[str, Any], symbols: dict[str, sp.Symbol]
) -> dict[str, Any]:
    """Samples of symbols with those of named springs, whose symbols are added to the others."""
    at = {symbols[name]: sample for name, sample in samples.items()}
    names = [d.symbol for d in springs]
    symbols |= {symbol.name: symbol for symbol in names}
    shape = np.shape(next(iter(samples.values()), 0.0))
    each = zip(names, values_of(names, at, springs), strict=True)
    return {**samples, **{s.name: np.broadcast_to(values, shape) for s, values in each}}


#: E A, E I_y, E I_z and G J of a beam by letter, each a name, or a formula that needs none.
_Stiffnesses = dict[str, Any]
_Material = tuple[Any, Any, str]  # E, G and its name


class NamedSprings:
    """Names for the stiffnesses of springs; those that are alike have one.

    Beams have names for their products, drives for a stiffness that is a number. A modulus that is
    a number has a name where the section has symbols. Beams in which shear counts, tapered ones
    and given matrices stay as they are.

    `taken`: names that stand for something else.
    """

    def __init__(self, robot: Robot, taken: Iterable[str]) -> None:
        self._taken, self._parts = {*taken}, [*_parts_of(robot)]
        self._beams: dict[SlenderBeam, _Stiffnesses] = {}
        self._drives: dict[tuple[Any, str], Any] = {}
        self._moduli: dict[tuple[str, _Material], Any] = {}
        self._products: dict[tuple[str, Any], Any] = {}
        self._sets: dict[tuple[Any, ...], _Stiffnesses] = {}
        self._definitions: dict[Any, Definition] = {}
        beams = [pair for part in self._parts for pair in part.beams]
        self._name_moduli([beam for _, beam in beams])
        for name, beam in beams:
            self._name_products(name, beam)
        for part, drive in ((x, x.drive) for x in self._parts):
            if drive is not None:
                if drive not in self._drives:
                    k, (stiffness, unit) = f"k_{self._number(('k',))}", drive
                    self._drives[drive] = self._define(k, exact_number(stiffness), unit)
                self._of_part(self._drives[drive], part.leg + part.name)

    def parts(self, read: Callable[[Any], Any]) -> dict[int, Any]:
        """Parts with names in place of springs, by the ids of those of the robot.

        Compliances are those of what is read.
        """
        changed: dict[int, Any] = {}
        for part in self._parts if self._definitions else ():
            new: dict[str, Any] = {}
            elasticity, of_telescope = part.elasticity, getattr(part.own, "beams", ())
            if elasticity is not None and elasticity.beam is not None:
                found = self._beams[elasticity.beam]
                L, *products = map(read, (exact_number(elasticity.beam.length), *found.values()))
                compliance = cantilever_compliance(L, 1, 1, *products)
                new["elasticity"] = replace(elasticity, compliance=compliance, beam=None)
            if of_telescope:
                beams = list(of_telescope)
                for i, x in enumerate(beams):
                    if (stiffnesses := self._beams.get(_slender(x))) is not None:
                        # Products in place of a section, and moduli of 1.
                        plain, section = (
                            Material(x.material.name, 1, 1),
                            CrossSection(*stiffnesses.values()),
                        )
                        beams[i] = replace(x, material=plain, section=section)
                new["beams"] = tuple(beams)
            if part.drive is not None:
                new["role"] = replace(part.own.role, stiffness=self._drives[part.drive])
            if new:
                changed[id(part.own)] = replace(part.own, **new)
        return changed

    @property
    def definitions(self) -> tuple[Definition, ...]:
        """What the names stand for, in the order in which it can be computed."""
        return tuple(self._definitions.values())

    def _name_moduli(self, beams: Iterable[SlenderBeam]) -> None:
        """Names for the moduli of materials that are numbers beside symbols."""
        needed: dict[_Material, dict[str, Any]] = {}
        for beam in beams:
            E, G = map(exact_number, (beam.E, beam.G))
            moduli = needed.setdefault((E, G, beam.material), {})
            if not E.free_symbols and any(map(_has_symbols, (beam.A, beam.Iy, beam.Iz))):
                moduli["E"] = E
            if not G.free_symbols and _has_symbols(beam.J):
                moduli["G"] = G
        needed = {material: moduli for material, moduli in needed.items() if moduli}
        is_one = len(needed) == 1 and not self._taken & {"E", "G"}
        for material, moduli in needed.items():
            number = "" if is_one else f"_{self._number(('E', 'G'))}"
            for letter, value in sorted(moduli.items()):
                self._moduli[letter, material] = self._define(letter + number, value)

    def _name_products(self, name: str, beam: SlenderBeam) -> None:
        """Names for the products of a beam that are no short formulas."""
        E, G, A, Iy, Iz, J = map(exact_number, (beam.E, beam.G, beam.A, beam.Iy, beam.Iz, beam.J))
        is_named = not beam.material.startswith("material")
        words = beam.material if is_named else f"the material of {name}"

        def product(letter: str, modulus: Any, section: Any) -> Any:
            name_of_modulus = self._moduli.get((letter, (E, G, beam.material)))
            if name_of_modulus is None or not section.free_symbols:
                return modulus * section
            self._of_part(name_of_modulus, words)
            return name_of_modulus * section

        EA, EI_y, EI_z = (product("E", E, x) for x in (A, Iy, Iz))
        written = {"EA": EA, "EI_y": EI_y, "EI_z": EI_z, "GJ": product("G", G, J)}
        key = tuple(written.values())
        if key not in self._sets:
            number, named = self._number(_LETTERS), dict[str, Any]()
            for letter, expression in written.items():
                alike = letter in ("EI_z", "EI_y") and written["EI_y"] == written["EI_z"]
                kind = "EI" if alike else letter
                if count_of(expression) <= _SHORT and expression.free_symbols:
                    named[letter] = expression
                    continue
                # A stiffness that another beam has, too, keeps its name.
                if (kind, expression) not in self._products:
                    self._products[kind, expression] = self._define(f"{kind}_{number}", expression)
                named[letter] = self._products[kind, expression]
            self._sets[key] = named
        self._beams[beam] = found = self._sets[key]
        for symbol in found.values():
            self._of_part(symbol, name)

    def _define(self, name: str, expression: Any, unit: str = "") -> Any:
        symbol = sp.Symbol(name, positive=True)
        self._definitions.setdefault(symbol, Definition(symbol, expression, unit=unit))
        return symbol

    def _of_part(self, symbol: Any, name: str) -> None:
        """List a part of which it is a stiffness."""
        definition = self._definitions.get(symbol)
        if definition is not None and name not in definition.parts:
            self._definitions[symbol] = replace(definition, parts=(*definition.parts, name))

    def _number(self, letters: Iterable[str]) -> int:
        """The first number with which no letter stands for something else."""
        names = ({f"{x}_{number}" for x in letters} for number in count(1))
        free = next(x for x in names if not x & self._taken)
        self._taken |= free
        return int(min(free).rpartition("_")[2])


def _has_symbols(value: Any) -> bool:
    return bool(exact_number(value).free_symbols)


def _slender(beam: TelescopicBeam) -> Any:
    """A beam of a telescope, of unit length; None where it is no slender one."""
    return SlenderBeam.of(1, beam.material, beam.section, beam.theory)


@frozen(eq=False)
class _Part:
    """An element or coupling of a chain, or a part of the platform."""

    own: Any
    name: str
    leg: str = ""  # before the name of a drive, where that of another leg may be called alike
    freedoms: tuple[Screw, ...] = ()

    @property
    def elasticity(self) -> Elasticity | None:
        """Of a link."""
        return getattr(self.own, "elasticity", None)

    @property
    def beams(self) -> Iterator[tuple[str, SlenderBeam]]:
        """Its slender beams, with their names."""
        if self.elasticity is not None and self.elasticity.beam is not None:
            yield self.name, self.elasticity.beam
        each = getattr(self.own, "beams", ())
        for i, beam in enumerate(each, start=1):
            slender = _slender(beam)
            if slender is not None:
                yield f"{self.name}.beam{i if len(each) > 1 else ''}", slender

    @property
    def drive(self) -> tuple[Any, str] | None:
        """Stiffness and unit of a drive whose stiffness is a number."""
        units = {"N m/rad" if screw.turns else "N/m" for screw in self.freedoms}
        stiffness = getattr(getattr(self.own, "role", None), "stiffness", None)
        if stiffness is None or isinstance(stiffness, StiffnessLaw) or len(units) != 1:
            return None
        return None if _has_symbols(stiffness) else (stiffness, units.pop())


def _parts_of(robot: Robot) -> Iterator[_Part]:
    users: dict[int, list[str]] = {}
    for leg in robot.legs:
        users.setdefault(id(leg.chain), []).append(leg.name)
    chains = {id(leg.chain): leg.chain for leg in robot.legs}
    for chain, names in users.items():
        alone = len(users) > 1 and len(names) == 1
        yield from _parts_of_chain(chains[chain], "", f"{names[0]}/" if alone else "")
    for part in () if robot.platform is None else robot.platform.parts:
        yield _Part(part, f"platform/{part.name}")


def _parts_of_chain(chain: Chain, prefix: str, leg: str) -> Iterator[_Part]:
    freedoms: dict[str, tuple[Screw, ...]] = {}
    for element in chain.elements:
        name = getattr(element, "name", "")
        if isinstance(element, ParallelBlock):
            # In a machine also those of the robot that a block is by itself.
            for branch in (*element.branches, *getattr(element.robot, "legs", ())):
                yield from _parts_of_chain(branch.chain, f"{prefix}{name}/{branch.name}/", leg)
        else:
            freedoms[name] = getattr(element, "freedoms", ())
            yield _Part(element, prefix + name, leg, freedoms[name])
    for coupling in chain.couplings:
        of_first = freedoms.get(coupling.terms[0][0], ())
        yield _Part(coupling, prefix + coupling.name, leg, of_first)
