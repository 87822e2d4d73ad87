"""Model files read once more, from the page on model files alone: NumPy and a YAML reader.

Numbers, frames, kinematics and elasticity are written anew here. Every joint is a coordinate, the
loops are closed by Newton's method, in small steps from home, and all springs are unknowns of one
system. Nothing is shared with the library but the page.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from tests.generators.chains import beam_compliance_of

_UNITS = {
    "m": 1,
    "mm": 1e-3,
    "um": 1e-6,
    "cm": 1e-2,
    "km": 1e3,
    "rad": 1,
    "mrad": 1e-3,
    "N": 1,
    "deg": math.pi / 180,
    "kN": 1e3,
    "MN": 1e6,
    "GN": 1e9,
    "Pa": 1,
    "kPa": 1e3,
    "MPa": 1e6,
    "GPa": 1e9,
    "kg": 1,
    "g": 1e-3,
    "s": 1,
    "inch": 0.0254,
    "arcmin": math.pi / 10800,
}
_NAME = "|".join(sorted(_UNITS, key=len, reverse=True))
_POWER = rf"(?:{_NAME})(?:\^\d+)?(?![\w(])"
_UNIT = rf"{_POWER}(?:\s*/\s*{_POWER}|\s+{_POWER})*"
_QUANTITY = re.compile(rf"(?<![\w.])(\d+\.?\d*(?:[eE][+-]?\d+)?)(?:\s*({_UNIT}))?(?!\w)")
_FUNCTIONS = {
    name: getattr(math, name)
    for name in ("sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sqrt", "hypot", "pi")
} | {"abs": abs, "min": min, "max": max}
_AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}
_MATERIALS = {
    "steel": (210e9, 210e9 / 2.6),
    "aluminium": (70e9, 70e9 / 2.6),
    "cast-iron-ductile": (169e9, 169e9 / 2.55),
    "titanium-6al-4v": (110.3e9, 42.7e9),
}


def number(value: Any, scope: dict[str, float]) -> float:
    """A value of a model file in SI units."""
    if not isinstance(value, str):
        return float(value)

    def in_si(found: re.Match[str]) -> str:
        factor = 1.0
        below = False
        for sign, name, power in re.findall(rf"(/?)\s*({_NAME})(?:\^(\d+))?", found[2] or ""):
            below = sign == "/"
            factor *= _UNITS[name] ** (int(power or 1) * (-1 if below else 1))
        return f"({float(found[1])!r}*{factor!r})"

    text = _QUANTITY.sub(in_si, value).replace("^", "**")
    return float(eval(text, {"__builtins__": {}}, {**_FUNCTIONS, **scope}))  # noqa: S307


def vector(value: Any, scope: dict[str, float]) -> np.ndarray:
    return np.array([number(own, scope) for own in value])


def direction(value: Any, scope: dict[str, float]) -> np.ndarray:
    """A unit vector: an axis by its name, or three values."""
    if isinstance(value, str):
        found = np.array(_AXES[value.lstrip("-")], float) * (-1 if value.startswith("-") else 1)
    else:
        found = vector(value, scope)
    return found / np.linalg.norm(found)


def cross(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def turned(rotation: np.ndarray) -> np.ndarray:
    """Matrix of a rotation vector, Rodrigues' formula."""
    angle = np.linalg.norm(rotation)
    if angle < 1e-9:
        return np.eye(3) + cross(rotation)
    e = cross(rotation / angle)
    return np.eye(3) + math.sin(angle) * e + (1 - math.cos(angle)) * e @ e


def rotation_vector(R: np.ndarray) -> np.ndarray:
    """Rotation vector of a matrix, by its quaternion."""
    K = np.empty((4, 4))
    K[:3, :3] = R + R.T - np.trace(R) * np.eye(3)
    K[:3, 3] = K[3, :3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    K[3, 3] = np.trace(R)
    q = np.linalg.eigh(K)[1][:, -1]
    q = q if q[3] >= 0 else -q
    sine = np.linalg.norm(q[:3])
    return 2 * q[:3] if sine < 1e-12 else q[:3] / sine * 2 * math.atan2(sine, q[3])


def placed(R: np.ndarray, p: np.ndarray) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T


def frame(written: dict[str, Any] | None, scope: dict[str, float], at: str = "at") -> np.ndarray:
    """A frame, or what a rigid part makes of it."""
    own = written or {}
    R = np.eye(3)
    for turn in own.get("turn", ()):
        ((axis, angle),) = turn.items()
        R = R @ turned(number(angle, scope) * np.array(_AXES[axis], float))
    if "rotation_vector" in own:
        R = turned(vector(own["rotation_vector"], scope))
    if "matrix" in own:
        R = np.array([vector(row, scope) for row in own["matrix"]])
    if "axes" in own:
        given = {name: direction(value, scope) for name, value in own["axes"].items()}
        missing = next(name for name in "xyz" if name not in given)
        i = "xyz".index(missing)
        given[missing] = np.cross(given["xyz"[(i + 1) % 3]], given["xyz"[(i + 2) % 3]])
        R = np.stack([given[name] for name in "xyz"], axis=-1)
    return placed(R, vector(own.get(at, (0, 0, 0)), scope))


def moved(v: np.ndarray) -> np.ndarray:
    """Twist about a point at v from the twist about the origin."""
    J = np.eye(6)
    J[:3, 3:] = -cross(v)
    return J


@dataclass
class Motion:
    """A coordinate: its axis and advance per radian (None: a slide)."""

    axis: np.ndarray
    advance: float | None
    role: str | None
    stiffness: Any
    name: str
    home: float
    scope: dict[str, float]


@dataclass
class Ball:
    """Three turns whose coordinates are a rotation vector."""

    role: str | None
    stiffness: Any
    name: str
    home: np.ndarray
    scope: dict[str, float]


@dataclass
class Soft:
    """A part with a compliance in axes of its own about a point of the frame before it."""

    C: np.ndarray
    free: np.ndarray
    axes: np.ndarray
    at: np.ndarray


@dataclass
class Stretching:
    """Beams one after the other whose lengths follow the coordinate before them."""

    along: np.ndarray
    axes: np.ndarray
    beams: list[tuple[float, float, Callable[[float], np.ndarray]]]


@dataclass
class Branch:
    start: np.ndarray
    parts: list[Any]
    end: np.ndarray
    couplings: list[tuple[dict[str, float], float, Any, str | None]]


@dataclass
class Block:
    branches: list[Branch]


def section(written: Any, nu: float, scope: dict[str, float], named: dict[str, Any]) -> Any:
    """A, Iy, Iz, J, ky, kz of a cross-section."""
    if isinstance(written, str):
        written = named[written]
    ((shape, own),) = written.items()
    d = {key: number(value, scope) for key, value in own.items()}
    if shape == "properties":
        k = d.get("shear_factor_y", math.inf), d.get("shear_factor_z", math.inf)
        return d["A"], d["Iy"], d["Iz"], d["J"], *k
    if shape == "circle":
        I = math.pi * d["diameter"] ** 4 / 64
        k = 6 * (1 + nu) / (7 + 6 * nu)
        return math.pi * d["diameter"] ** 2 / 4, I, I, 2 * I, k, k
    if shape == "tube":
        D, i = d["outer_diameter"], d["inner_diameter"]
        I = math.pi * (D**4 - i**4) / 64
        m = (i / D) ** 2
        k = 6 * (1 + nu) * (1 + m) ** 2 / ((7 + 6 * nu) * (1 + m) ** 2 + (20 + 12 * nu) * m)
        return math.pi * (D**2 - i**2) / 4, I, I, 2 * I, k, k
    b, h = d["width_y"], d["height_z"]
    if shape == "rectangle":
        long, short = max(b, h), min(b, h)
        series = sum(math.tanh(n * math.pi * long / 2 / short) / n**5 for n in range(1, 2000, 2))
        J = long * short**3 / 3 * (1 - 192 * short / math.pi**5 / long * series)
        k = 10 * (1 + nu) / (12 + 11 * nu)
        return b * h, b * h**3 / 12, h * b**3 / 12, J, k, k
    assert shape == "box", shape
    t = d["wall"]
    B, H = b - 2 * t, h - 2 * t
    # Of four straight walls and, at each of the four corners, what one of infinite walls adds.
    area = B * H + (B + H) * t + 0.5793356158464 * t**2
    flux = 2 * (B + H) / t + 4 * (1 - 2 / math.pi * math.log(2))
    J = 4 * area**2 / flux + 2 * (B + H) * t**3 / 3 + 1.6232958564 * t**4
    return b * h - B * H, (b * h**3 - B * H**3) / 12, (h * b**3 - H * B**3) / 12, J, None, None


def beam_axes(along: np.ndarray, y: np.ndarray | None) -> np.ndarray:
    x = along / np.linalg.norm(along)
    near = np.eye(3)[np.argmin(np.abs(x))] if y is None else y
    across = near - (near @ x) * x
    across /= np.linalg.norm(across)
    return np.stack([x, across, np.cross(x, across)], axis=-1)


@dataclass
class File:
    """What a model file says, before any pose."""

    path: Path
    given: dict[str, Any] = field(default_factory=dict)
    outer: dict[str, float] = field(default_factory=dict)
    text: str | None = None

    def __post_init__(self) -> None:
        self.data = yaml.safe_load(self.text or self.path.read_text())
        written = {**self.data.get("parameters", {}), **self.given}
        self.scope: dict[str, float] = {}
        while len(self.scope) < len(written):
            before = len(self.scope)
            for name in written.keys() - self.scope.keys():
                try:
                    self.scope[name] = number(written[name], self.scope)
                except NameError:
                    continue
            assert len(self.scope) > before, "parameters in a circle"

    def material(self, written: Any, scope: dict[str, float]) -> tuple[tuple[float, float], float]:
        own = (
            self.data.get("materials", {}).get(written, written)
            if isinstance(written, str)
            else written
        )
        if isinstance(own, str):
            EG = _MATERIALS[own]
        else:
            E = number(own["E"], scope)
            G = (
                number(own["G"], scope)
                if "G" in own
                else E / 2 / (1 + number(own["poisson_ratio"], scope))
            )
            EG = E, G
            if "G" in own:
                return EG, 0.3
        return EG, EG[0] / 2 / EG[1] - 1

    def beam(self, L: float, own: dict[str, Any], scope: dict[str, float]) -> np.ndarray:
        shear = own.get("theory") == "timoshenko"
        pieces = own.get("taper") or [{"share": 1, "section": own["section"]}]
        C = np.zeros((6, 6))
        left = 1.0
        for piece in pieces:
            share = number(piece["share"], scope)
            left -= share
            (E, G), nu = self.material(piece.get("material", own.get("material")), scope)
            A, Iy, Iz, torsion, *k = section(
                piece["section"], nu, scope, self.data.get("sections", {})
            )
            J = moved(np.array([left * L, 0, 0]))  # from the end of the piece to the tip
            sizes = E * A, E * Iy, E * Iz, G * torsion
            sizes += tuple(1 / (factor * G * A) for factor in k) if shear else ()
            C += J @ beam_compliance_of(share * L, *sizes) @ J.T
        return C

    def soft(self, own: dict[str, Any], scope: dict[str, float]) -> tuple[np.ndarray, np.ndarray]:
        """Compliance and free directions of a written matrix."""
        key = "stiffness" if "stiffness" in own else "compliance"
        M = np.array(
            [vector(r, scope) for r in own[key]]
            if isinstance(own[key][0], list)
            else np.diag(vector(own[key], scope))
        )
        if key == "compliance":
            return M, np.zeros((6, 0))
        d = np.where(np.diag(M) > 0, 1 / np.sqrt(np.where(np.diag(M) > 0, np.diag(M), 1)), 1)
        w, V = np.linalg.eigh(d[:, None] * M * d)
        V = d[:, None] * V
        ok = w > 1e-12
        return (V[:, ok] / w[ok]) @ V[:, ok].T, V[:, ~ok]

    def couplings(self, written: Any, scope: dict[str, float]) -> list[Any]:
        found = []
        for own in written or ():
            k = number(own["stiffness"], scope) if "stiffness" in own else None
            if "sum" in own:
                terms = {name: number(f, scope) for name, f in own["sum"].items()}
                found.append(
                    (
                        terms,
                        None if "equals" not in own else number(own["equals"], scope),
                        k,
                        own.get("role", "locked"),
                    )
                )
            else:
                terms = {own["joint"]: 1.0, own["follows"]: -number(own["ratio"], scope)}
                found.append((terms, number(own.get("offset", 0), scope), k, "locked"))
        return found

    def copies(
        self, written: Any, scope: dict[str, float]
    ) -> list[tuple[dict[str, Any], dict[str, float]]]:
        """Legs or branches, each with its variables."""
        found = []
        for own in [written] if isinstance(written, dict) else written:
            repeat = own.get("repeat")
            if repeat is None:
                found.append((own, scope))
                continue
            if isinstance(repeat, dict):
                sets = [
                    {"name": f"{repeat.get('name', 'leg')}{i}", repeat["variable"]: i}
                    for i in range(1, repeat["count"] + 1)
                ]
            else:
                sets = repeat
            for variables in sets:
                mine = dict(scope)
                for name, value in variables.items():
                    if name != "name":
                        mine[name] = number(value, scope)
                let = dict(own.get("let", {}))
                while let:
                    for name in list(let):
                        try:
                            mine[name] = number(
                                let[name], {k: v for k, v in mine.items() if k not in let}
                            )
                        except NameError:
                            continue
                        del let[name]
                found.append(({**own, "name": variables["name"]}, mine))
        return found

    def chain(self, written: list[dict[str, Any]], scope: dict[str, float]) -> list[Any]:
        parts: list[Any] = []
        counts: dict[str, int] = {}
        for own in written:
            kind = own["type"]
            counts[kind] = counts.get(kind, 0) + 1
            name = own.get("name", f"{kind}{counts[kind]}")
            role, k = own.get("role"), own.get("stiffness")
            home = own.get("home", 0)
            homes = vector(home if isinstance(home, list) else [home], scope)

            def motion(axis: Any, advance: float | None, i: int = 0) -> Motion:
                h = homes[i] if i < len(homes) else 0.0  # noqa: B023
                return Motion(direction(axis, scope), advance, role, k, name, h, scope)  # noqa: B023

            if kind == "revolute":
                parts.append(motion(own["axis"], 0.0))
            elif kind == "prismatic":
                parts.append(motion(own["axis"], None))
            elif kind == "helical":
                parts.append(motion(own["axis"], number(own["pitch"], scope) / 2 / math.pi))
            elif kind == "universal":
                parts += [motion(axis, 0.0, i) for i, axis in enumerate(own["axes"])]
            elif kind == "spherical":
                parts.append(Ball(role, k, name, homes if len(homes) == 3 else np.zeros(3), scope))
            elif kind == "cylindrical":
                parts += [motion(own["axis"], None, 0), motion(own["axis"], 0.0, 1)]
            elif kind == "planar":
                n = direction(own["normal"], scope)
                a = np.eye(3)[np.argmin(np.abs(n))]
                a = (a - n * (n @ a)) / np.linalg.norm(a - n * (n @ a))
                parts += [motion(a, None, 0), motion(np.cross(n, a), None, 1), motion(n, 0.0, 2)]
            elif kind == "rigid":
                parts.append(frame(own, scope, "to"))
            elif kind == "beam":
                to = vector(own["to"], scope)
                y = direction(own["y_axis"], scope) if "y_axis" in own else None
                C = self.beam(float(np.linalg.norm(to)), own, scope)
                parts += [Soft(C, np.zeros((6, 0)), beam_axes(to, y), to), placed(np.eye(3), to)]
            elif kind == "spring":
                at = frame(own, scope)
                parts.append(Soft(*self.soft(own, scope), at[:3, :3], at[:3, 3]))
            elif kind == "link":
                to = frame(own, scope, "to")
                own_axes, at = to[:3, :3], to[:3, 3]
                parts += [Soft(*self.soft(own, scope), own_axes, at), placed(np.eye(3), at)]
            elif kind == "telescope":
                along = direction(own["direction"], scope)
                y = direction(own["y_axis"], scope) if "y_axis" in own else None
                rods = own.get("beams", [])
                fixed = any("fixed" in rod for rod in rods)
                share = 1.0 if len(rods) == 1 else 0.0
                assert len(rods) < 2 or fixed or all("share" in rod for rod in rods)
                parts.append(motion(own["direction"], None))
                cut = [
                    (
                        number(rod.get("fixed", 0), scope),
                        number(rod.get("share", share), scope),
                        lambda L, rod=rod: self.beam(L, rod, scope),
                    )
                    for rod in rods
                ]
                parts.append(Stretching(along, beam_axes(along, y), cut))
                if not own.get("home") and rods:
                    parts[-2].home = math.nan
            elif kind == "parallelogram":
                bar = vector(own["across"], scope) / 2
                inner = self.chain(own["chain"], scope)
                ends = (placed(np.eye(3), s * bar) for s in (-1, 1))
                parts.append(Block([Branch(end, inner, end, []) for end in ends]))
            elif kind == "parallel":
                copies = self.copies(own["branches"], scope)
                parts.append(Block([self.branch(b, "start", "end", s) for b, s in copies]))
            else:
                raise NotImplementedError(kind)
        return parts

    def legs(self, data: dict[str, Any], scope: dict[str, float]) -> list[Branch]:
        if "dh" in data:
            return [self.table(data["dh"], scope)]
        copies = self.copies(data["legs"], scope)
        return [self.branch(leg, "base", "platform", s) for leg, s in copies]

    def branch(self, own: dict[str, Any], start: str, end: str, scope: dict[str, float]) -> Branch:
        chain, couplings = own["chain"], self.couplings(own.get("couplings"), scope)
        ends = frame(own.get(start), scope), frame(own.get(end), scope)
        return Branch(ends[0], self.chain(chain, scope), ends[1], couplings)

    def table(self, dh: dict[str, Any], scope: dict[str, float]) -> Branch:
        parts: list[Any] = []
        z, x = np.eye(3)[2], np.eye(3)[0]
        for own in dh["joints"]:
            a, d, alpha, theta = (
                number(own.get(key, 0), scope) for key in ("a", "d", "alpha", "theta")
            )
            slides = own.get("type") == "prismatic"
            joint = Motion(
                z,
                None if slides else 0.0,
                "actuated",
                own.get("stiffness"),
                "",
                number(own.get("home", 0), scope),
                scope,
            )
            turn, shift = placed(turned(theta * z), np.zeros(3)), placed(np.eye(3), d * z)
            across = placed(turned(alpha * x), a * x)
            if dh["convention"] == "standard":
                parts += [joint, turn @ shift @ across]
            else:
                parts += [across, joint, turn @ shift]
        return Branch(
            frame(dh.get("base"), scope), parts, np.linalg.inv(frame(dh.get("tool"), scope)), []
        )
