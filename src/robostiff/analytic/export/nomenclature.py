"""What the names of a formula mean, with the values of springs, and where the formula holds."""

from __future__ import annotations

import re
from collections.abc import Container, Sequence
from itertools import chain
from typing import Any

import sympy as sp

from robostiff.analytic.derivation import Formula
from robostiff.analytic.exact.definition import Condition, Definition
from robostiff.analytic.export.entries import EntryNames, differential_parts
from robostiff.analytic.export.notation import (
    OWN_AXES,
    Block,
    EquationRows,
    Meaning,
    Nomenclature,
    Sentences,
    Title,
    is_value,
    meanings_of_given,
)
from robostiff.analytic.vectors.forms import InSeries, VectorForm
from robostiff.analytic.vectors.vector_expressions import (
    Coordinates,
    Cross,
    Dot,
    Equation,
    Norm,
    Vector,
    names_in,
)
from robostiff.spatial import Space

OF_T = "turns it to world axes and moves it to the reference point"
_OF_SPRINGS = {
    "E": ("Young's modulus", "GPa"),
    "G": ("shear modulus", "GPa"),
    "k": ("stiffness", ""),
    "EA": ("axial stiffness E A", "N"),
    "EI": ("bending stiffness E I", "N m²"),
    "EI_y": ("bending stiffness E I about y", "N m²"),
    "EI_z": ("bending stiffness E I about z", "N m²"),
    "GJ": ("torsional stiffness G J", "N m²"),
}
#: Of names that a search for short formulas gives, by their letter.
_OF_RECURRING = {
    "L": "length, by its equation",
    "d": "length, by its equation",
    "theta": "angle",
    "u": "component of the unit vector along a leg",
    "m": "component of the moment of a wrench",
    "e": "how much of a wrench is taken from another, so that both share no energy",
    "k": "stiffness, by its equation",
    "p": "expression that recurs",
    "s": "expression that recurs",
    "t": "expression that recurs",
    "K": "entry of the stiffness matrix",
    "B": "coordinate of a joint of a leg on the platform",
    "c": "compliance of a leg under a wrench",
    "a": "step of an inversion",
    "mu": "stiffness against the unit motion of a joint",
}
_OF_NAMES = {
    "L": "length of a leg",
    "d": "unit vector along a leg's rod",
    "B": "joint of a leg on the platform",
    "s": "coordinate of a slide",
}
_MEANINGS = {
    "p": "point of the platform",
    "R": "rotation of the platform",
    "Q": "rotation of the platform",
    "r_0": "reference point, in the axes of the platform",
    "a_i": "joint of leg i on the base",
    "b_i": "its joint on the platform, in the platform's axes",
    "d_i": "from this joint of the leg to that on the platform",
    "L_i": "length of this vector",
    "u_i": "unit vector along the leg",
    "e_i": "first axis of the joint on the base",
    "j_i": "axis of the leg's last joint",
    "g_i": "unit vector across the first axis of the joint and the leg",
    "n_i": "unit vector across both axes of the joint",
    "k_i": "stiffness of the spring that differs between the legs",
    "W_i": "wrenches of leg i, side by side",
    "C_i": "compliances c_i_jk that the wrenches j and k of leg i share",
    "o_i": "what of the couple comes with the force, so that both share no energy",
    "r_ij": "from the middle of the rods to the end of rod j, in the platform's axes",
    "v_ij": "couple by which rod j of leg i turns its middle",
    "c_r": "compliance of a rod",
    "phi_i": "angle of a_i about z",
    "psi_i": "angle of b_i about z",
    "theta_i": "angle of e_i about z",
    "chi_i": "angle of j_i about z",
    "crank_i": "length of the crank of leg i",
    "l_i": "length of its rod",
    "sigma_i": "1 or -1: on which side the leg is assembled",
}
OF_STRUTS = {"a_i", "b_i", "d_i", "L_i", "u_i", "w_i", "c_i"}
_OF_RODS = {
    "b_i": "joint of its rod on the platform, in the platform's axes",
    "u_i": "unit vector along its rod",
    "j_i": "first axis of the joint at the rod's foot",
}
_OF_SLIDES = {
    **_OF_RODS,
    "a_i": "foot of the rod of leg i where its slide is at zero",
    "e_i": "direction of the slide",
    "d_i": "from this foot to the joint on the platform",
    "y_i": "distance of this joint from the line of the slide",
    "x_i": "how far along the slide it is",
    "q_i": "coordinate of the slide",
    "f_i": "force along the slide, of a unit force in the rod",
}
_OF_CRANKS = {
    **_OF_RODS,
    "a_i": "point of the axis of leg i's crank, in the crank's plane",
    "e_i": "axis of the crank",
    "d_i": "from this point to the joint on the platform",
    "y_i": "distance of this joint from the axis",
    "x_i": "cosine of the angle between the crank and this vector, seen along the axis",
    "m_i": "unit vector across this axis and the platform joint",
    "v_i": "unit vector along the crank",
    "f_i": "force along the crank, of a unit force in the rod",
    "h_i": "force across the crank",
    "z_i": "force along the axis of the crank",
}
_OF_LINKS = {
    **_OF_CRANKS,
    "a_i": "first joint of leg i where its slide is at zero",
    "b_i": "its last joint, in the platform's axes",
    "e_i": "direction of the slide and of the joints",
    "d_i": "from a_i to the last joint",
    "q_i": "coordinate of the slide",
    "y_i": "distance of the last joint from the first one",
    "x_i": "cosine of the angle between the first link and n_i",
    "m_i": "unit vector across the slide and n_i",
    "n_i": "unit vector from the first joint to the last one",
    "g_i": "unit vector across the slide and the second link",
    "u_i": "unit vector along the second link",
    "v_i": "unit vector along the first link",
    "f_i": "cosine of the angle between the links",
    "h_i": "its sine",
}
#: Of legs and arms by their springs, in order; {i} is the index of a generic leg, {of} what it is.
_OF_WALK = {
    "C{i}": "compliance about the reference point, world axes",
    "p(_C)?": "reference point",
    "[RQ]": "rotation of the platform",
    "a_i": "base of leg i",
    "e_i": "axis of its first joint",
    "j_i": "axis of its last joint, in the platform's axes",
    "u_i": "the same in the world",
    "v_i": "axis of the joint between them",
    "b_i": "from the reference point to the end of leg i, in the platform's axes",
    "p_i": "reference point, by leg i",
    "R_i": "rotation of the platform, by leg i",
    "(alpha|beta|gamma)_i": "turns of the base of leg i about x, y and z",
    "(lambda|mu|nu)_i": "turns of the platform behind the end of leg i",
    "phi_i": "angle of the base of leg i",
    "psi_i": "angle of its end on the platform",
    r"(theta|s)_i_\d+": "joint coordinates of leg i",
    "K_i": "stiffness of leg i",
    "W_i": "wrenches that do no work on its passive joints, side by side",
    "J_i": "twists of its passive joints, side by side",
    "R{i}_.*": "rotations of the parts of the {of}, one after the other",
    "p{i}_(?!C$).*": "points between these parts",
    "Q{i}_.*": "axes of a beam",
    "m{i}_.*": "from the reference point to the middle of a beam",
    r"B_\d+": "axes of the base of a module",
    r"v_\d+": "from the reference point to the origin of a module's platform",
    "t{i}_.*": "twist of the unit motion of a drive",
    "j{i}_.*": "twist of the unit motion of a passive joint",
    "c": "compliance of a drive",
    "D": "compliance of a beam about its middle, in its own axes",
    "T": OF_T,
    "L'?|EA'?|EI_[yz]'?|GJ'?": (
        "its length, and stiffness against traction, bending about y and z, and torsion"
    ),
}


def nomenclature_of(
    formula: Formula,
    names: EntryNames,
    rows: Sequence[Meaning],
    first: Sequence[str] = (),
    blocks: Sequence[Block] = (),
) -> Nomenclature:
    """K, further names, and what is given, the `first` of these before the others.

    `blocks`: what is printed, with symbols of wrenches and points that cancel in K.
    """
    space = Space.of_size(formula.matrices[0].rows)
    wrench, twist = ", ".join(space.wrench_order), ", ".join(space.twist_order)
    result: Meaning = (
        (Vector(names.result),),
        f"stiffness about the reference point: wrench ({wrench}) for twist ({twist}); "
        "force before moment, translation before rotation, SI units",
    )
    found = sorted({*names.given, *(names_in(list(blocks)) & formula.meanings.keys())})
    given = dict.fromkeys((*(name for name in first if name in found), *found))
    words: dict[Any, dict[str, None]] = {}
    for of, meaning in rows:  # that of a module and of a machine may differ
        words.setdefault(of, {})[meaning] = None
    joined = ((of, "; ".join(each)) for of, each in words.items())
    return Nomenclature((result, *joined, *meanings_of_given(given, formula.meanings)))


def meanings_of_legs(
    formula: Formula, form: Any, names: EntryNames, steps: Sequence[Definition] = ()
) -> list[Meaning]:
    """Of wrenches or of compliances, of names among steps, and of vectors.

    `form`: the vector level of the formula, or what of it is printed; None where there is none.
    """
    defined = {d.symbol.name.partition("_")[0] for d in steps}
    of_steps: list[Meaning] = [((x,), words) for x, words in _OF_NAMES.items() if x in defined]
    of_form: list[Meaning] = []
    if not (form is None or isinstance(form, InSeries)):
        of_form = _meanings_of_form(form, names)
        if not form.wrenches:
            return [*of_form, *of_steps]
    if form is None or of_form:
        wrench = ", ".join(Space.of_size(formula.matrices[0].rows).wrench_order)
        return [
            ((Vector(names.generic("w")),), f"wrench ({wrench}) that a leg transmits"),
            ((names.generic("c"),), "compliance of the leg under this wrench"),
            *of_steps,
            *of_form,
        ]
    return [
        ((Vector("C"),), "compliance in axes of the arm"),
        ((Vector("K_0"),), "stiffness there"),
        (OWN_AXES, "axes of the arm in the world, and their origin"),
        ((Vector("T"),), OF_T),
        *of_steps,
    ]


def _meanings_of_form(found: VectorForm, given: EntryNames) -> list[Meaning]:
    """Of the names of one leg, of the pose, of rods, and of springs."""
    of, index = ("arm", "") if found.is_arm else ("leg", "_i")
    forms, by_springs = (found, *found.others), not found.wrenches
    columns = {name: isinstance(c[0], Coordinates) for x in forms for name, c in x.columns.items()}
    legs = [e for form in forms for e in form.leg]
    names = {f"C{index}": True} if by_springs or found.coupled else {}
    names |= {e.name: e.is_vector for e in (*found.pose, *legs, *found.of_rod)} | columns
    names |= {"r_ij": True} if found.rods else {}
    names |= dict.fromkeys(("K_i", "W_i", "J_i"), True) if found.passive or found.coupled else {}
    names |= {"c": False} if found.drives else {}
    if found.beams:
        names |= {"D": True, "T": True} | dict.fromkeys(letters_of_beam(given.given), False)
    listed = _OF_WALK
    if not by_springs:
        of_slides = _OF_SLIDES if "q_i" in names else {}
        of_carrier = (_OF_LINKS if of_slides else _OF_CRANKS) if "v_i" in names else of_slides
        listed, along = {**_MEANINGS, **of_carrier}, "rod" if of_carrier else "leg"
        for equation in (e for e in legs if e.name in ("s_i", "t_i")):
            # The cosine a . u and the sine |a x u| of the angle of a vector and a leg.
            match equation.expression:
                case Dot((Vector(name), _)):
                    function = "cosine"
                case Norm((Cross((Vector(name), _)),)):
                    function = "sine"
                case _:
                    continue
            other = f"the {listed[name]}" if name in listed else name
            listed[equation.name] = f"{function} of the angle between the {along} and {other}"
    rows: list[Meaning] = []
    for pattern, words in listed.items():
        one = re.compile(pattern.format(i=index))
        each = [Vector(x) if names[x] else x for x in names if one.fullmatch(x)]
        is_row = pattern.endswith(".*") and len(each) > 2
        shown = (each[0], "...", each[-1]) if is_row else tuple(each)
        rows += [(shown, words.format(of=of))] if each else []
    coordinates: dict[str, list[str]] = {}
    for name in columns:
        if matched := re.fullmatch(r"(\w_i)[xyz]", name):
            coordinates.setdefault(matched[1], []).append(name)
    return [*rows, *((tuple(each), f"coordinates of {x}") for x, each in coordinates.items())]


def letters_of_beam(taken: Container[str]) -> list[str]:
    """Length and products of any beam, primed where they stand for something else."""
    return [x + "'" * (x in taken) for x in ("L", "EA", "EI_y", "EI_z", "GJ")]


def with_springs(blocks: Sequence[Block]) -> tuple[Block, ...]:
    """The same blocks with a line for each stiffness in the nomenclature, the last of them."""
    *others, last = blocks
    if not isinstance(last, Nomenclature):
        return tuple(blocks)
    equations = [b for b in others if isinstance(b, EquationRows)]
    named = {d.symbol.name: d for b in equations for d in b.springs}
    # Scalars that have an equation and that no row has.
    listed = {getattr(name, "name", name) for names, _ in last.rows for name in names}
    recurring: dict[str, dict[str, list[str]]] = {}  # by meaning and letter
    for name in dict.fromkeys(e.name for b in equations for e in b.rows if not e.is_vector):
        letter = name.partition("_")[0].rstrip("'0123456789")
        rate = differential_parts(name)
        meaning = f"derivative of a name above by {rate[1]}" if rate else _OF_RECURRING.get(letter)
        if meaning and not {name, letter, f"{letter}_1"} & listed:
            recurring.setdefault(meaning, {}).setdefault(letter, []).append(name)
    rows = list(last.rows)
    for words, letters in recurring.items():
        each = (x if len(x) < 4 else [*x[:2], "...", x[-1]] for x in letters.values())
        rows.append((tuple(chain(*each)), words))
    parts: dict[str, tuple[str, int]] = {}
    for name in named:
        letter, _, number = name.rpartition("_")
        parts[name] = (letter.replace("'", ""), int(number)) if letter else (name, 0)
    # Moduli first, then the stiffnesses of one beam after the other.
    for name in sorted(named, key=lambda x: (len(parts[x][0]) > 1, *parts[x][::-1])):
        d = named[name]
        words, unit = _OF_SPRINGS[parts[name][0]]
        size = 1e9 if unit == "GPa" else 1.0
        value = f", {float(d.expression) / size:.12g} {unit or d.unit}" if is_value(d) else ""
        rows.append(((d.symbol.name,), f"{words} of {', '.join(d.parts)}{value}"))
    shown = [b for b in others if not isinstance(b, EquationRows) or b.rows]
    after = [x.level if isinstance(x, Title) else 9 for x in (*shown[1:], last)]
    each = zip(shown, after, strict=True)  # a heading with nothing below it goes
    kept = [b for b, level in each if not (isinstance(b, Title) and b.level >= level)]
    return (*kept, Nomenclature(tuple(rows)))


_LONG = 20  # operations: such a condition is in words, and only programs have it in full
_LEGS = "{legs}"


def with_conditions(blocks: Sequence[Block], derivation: Any) -> tuple[Block, ...]:
    """The blocks of a derivation and, before its nomenclature, where the formula holds."""
    conditions, legs = derivation.conditions, _legs_of(derivation)
    *before, last = blocks
    beside = [c for c in conditions if not c.equations and c.expression.free_symbols]
    beside = [c for c in beside if not c.expression.is_Symbol]  # a symbol that is positive
    if not beside or not isinstance(last, Nomenclature):
        return tuple(blocks)
    taken = {str(name) for names, _ in last.rows for name in names}
    letter = "Delta"
    while any(name.startswith(letter) for name in taken):
        letter += "'"
    short = [c for c in beside if c.expression.count_ops() <= _LONG]
    # What is short for some legs alone is in words for all of them.
    of_legs = {(_of_any_leg(c), c.leg) for c in short}
    in_words = {_of_any_leg(c) for c in beside if (_of_any_leg(c), c.leg) not in of_legs}
    short = [c for c in short if _of_any_leg(c) not in in_words]
    groups: dict[Any, list[Condition]] = {}  # of legs alike one
    for c in short:
        groups.setdefault(_multiplied_out(c.expression), []).append(c)
    named = [(f"{letter}_{i}", alike) for i, alike in enumerate(groups.values(), start=1)]
    section: list[Block] = [Title("Where the formula holds")]
    if named:
        section.append(Sentences("It holds where these differences are positive."))
        section.append(EquationRows(tuple(Equation(x, alike[0].expression) for x, alike in named)))
    rest = [c for c in beside if c not in short]
    if rest:
        section.append(Sentences(f"It holds only where {_words(rest, legs)}."))
    rows = (((name,), f"positive where {_words(alike, legs)}") for name, alike in named)
    return (*before, *section, Nomenclature((*last.rows, *rows)))


def in_programs(derivation: Any) -> list[tuple[str, Any]]:
    """Words and expressions of the conditions of a derivation, once of legs alike."""
    legs = _legs_of(derivation)
    groups: dict[str, list[Condition]] = {}
    for c in derivation.conditions:
        groups.setdefault(_of_any_leg(c), []).append(c)
    found: dict[Any, tuple[str, Any]] = {}
    for alike in groups.values():
        words = _words(alike, legs)
        for c in alike:
            found.setdefault(_multiplied_out(c.expression), (words, c.expression))
    return list(found.values())


def _legs_of(derivation: Any) -> list[str]:
    """Names of all legs of a robot; none of other formulas."""
    whole = getattr(derivation, "derivation", derivation)
    return [getattr(leg, "name", leg) for leg in getattr(whole, "legs", ())]


def _words(conditions: Sequence[Condition], legs: Sequence[str]) -> str:
    """Of conditions, those of several legs together."""
    groups: dict[str, dict[str, None]] = {}
    for c in conditions:
        groups.setdefault(_of_any_leg(c), {})[c.leg] = None
    found = []
    for words, some in groups.items():
        named = "each leg" if {*some} == {*legs} else f"each of {', '.join(map(repr, some))}"
        found.append(words.replace(_LEGS, f"leg {next(iter(some))!r}" if len(some) == 1 else named))
    return "; ".join(found)


def _of_any_leg(condition: Condition) -> str:
    """Its words, with a mark in place of the leg."""
    return condition.words.replace(f"leg {condition.leg!r}", _LEGS)


def _multiplied_out(expression: Any) -> Any:
    """What is the same of conditions alike, where that is found at once."""
    return sp.expand(expression) if expression.count_ops() <= _LONG else expression
