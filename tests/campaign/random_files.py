"""Random model files: arms, platforms on legs, machines of modules, with every key of a chain."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import yaml

from tests.campaign.reread import frame, number, rotation_vector
from tests.campaign.reread_machine import Machine

_MATERIALS = [
    "steel",
    "aluminium",
    "cast-iron-ductile",
    "titanium-6al-4v",
    {"E": "140 GPa", "G": "5 GPa"},
    {"E": "68.9 GPa", "poisson_ratio": 0.33},
]
_LENGTHS = {"mm": 1e-3, "m": 1.0, "um": 1e-6, "": 1.0, "cm": 1e-2}
_ANGLES = {"deg": math.pi / 180, "rad": 1.0, "mrad": 1e-3, "": 1.0, "arcmin": math.pi / 10800}
_SLIDES = {"N/m": 1.0, "kN/mm": 1e6, "N/um": 1e6, "MN/m": 1e6, "N/mm": 1e3}
_TURNS = {"N m/rad": 1.0, "kN m/rad": 1e3, "N m/mrad": 1e3, "N m/deg": 180 / math.pi}


class Draw:
    """Random parts of a file, as they are written."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.size = 0.4

    def one(self, options: Any) -> Any:
        return options[int(self.rng.integers(len(options)))]

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def _in(self, value: float, units: dict[str, float]) -> Any:
        unit = self.one(list(units))
        text = f"{value / units[unit]:.17g} {unit}".strip()
        if unit == "" and self.chance(0.5):
            return float(text)
        return f"-({text[1:]})" if text.startswith("-") and self.chance(0.3) else text

    def length(self, value: float) -> Any:
        return self._in(value, _LENGTHS)

    def angle(self, value: float) -> Any:
        return self._in(value, _ANGLES)

    def point(self, size: float | None = None) -> list[Any]:
        size = self.size if size is None else size
        return [
            self.length(float(x)) if self.chance(0.8) else 0
            for x in self.rng.uniform(-size, size, 3)
        ]

    def unit(self) -> Any:
        if self.chance(0.5):
            return self.one(["x", "y", "z", "-x", "-y", "-z"])
        return [round(float(x), 3) for x in self.rng.normal(size=3)]

    def rotation(self) -> dict[str, Any]:
        kind = self.one(["none", "turn", "rotation_vector", "matrix", "axes"])
        if kind == "turn":
            axes = [self.one("xyz") for _ in range(int(self.rng.integers(1, 4)))]
            return {"turn": [{axis: self.angle(float(self.rng.uniform(-3, 3)))} for axis in axes]}
        if kind == "rotation_vector":
            return {kind: [self.angle(float(x)) for x in self.rng.uniform(-1.5, 1.5, 3)]}
        if kind in ("matrix", "axes"):
            Q = np.linalg.qr(self.rng.normal(size=(3, 3)))[0]
            Q *= np.linalg.det(Q)
            if kind == "matrix":
                return {kind: Q.tolist()}
            i, j = self.rng.permutation(3)[:2]
            f, g = self.rng.uniform(0.1, 3, 2)
            return {kind: {"xyz"[i]: (f * Q[:, i]).tolist(), "xyz"[j]: (g * Q[:, j]).tolist()}}
        return {}

    def frame(self, size: float | None = None) -> dict[str, Any]:
        return {"at": self.point(size), **self.rotation()}

    def material(self) -> Any:
        return self.one(_MATERIALS)

    def section(self, shear: bool) -> dict[str, Any]:
        d = float(self.rng.uniform(0.02, 0.08))
        e = d * float(self.rng.uniform(0.3, 1.7))
        t = min(d, e) * float(self.rng.uniform(0.05, 0.3))
        inner = d * float(self.rng.uniform(0.3, 0.95))
        L = self.length
        shapes = [
            {"circle": {"diameter": L(d)}},
            {"tube": {"outer_diameter": L(d), "inner_diameter": L(inner)}},
            {"rectangle": {"width_y": L(d), "height_z": L(e)}},
        ]
        if not shear:
            shapes.append({"box": {"width_y": L(d), "height_z": L(e), "wall": L(t)}})
        A, I = (
            f"{d * e * 1e6:.17g} mm^2",
            [f"{d**4 * f * 1e12:.17g} mm^4" for f in (0.05, 0.11, 0.09)],
        )
        own: dict[str, Any] = {"A": A, "Iy": I[0], "Iz": I[1], "J": I[2]}
        if shear:
            own |= {"shear_factor_y": 0.8, "shear_factor_z": 0.6}
        shapes.append({"properties": own})
        return self.one(shapes)

    def beam(self, to: list[Any]) -> dict[str, Any]:
        shear = self.chance(0.4)
        own: dict[str, Any] = {
            "type": "beam",
            "to": to,
            "y_axis": [0.3, -0.7, 0.43],
            "material": self.material(),
        }
        if shear:
            own["theory"] = "timoshenko"
        if self.chance(0.3):
            s = round(float(self.rng.uniform(0.2, 0.6)), 3)
            own["taper"] = [
                {"share": s, "section": self.section(shear)},
                {"share": f"1 - {s}", "section": self.section(shear), "material": self.material()},
            ]
        else:
            own["section"] = self.section(shear)
        return own

    def matrix(self, stiffness: bool) -> dict[str, Any]:
        scale = np.array([1e7] * 3 + [1e7 * self.size**2] * 3) * self.rng.uniform(0.2, 5, 6)
        if self.chance(0.5):
            if stiffness:
                return {
                    "stiffness": [
                        f"{k:.17g} {'N/m' if i < 3 else 'N m/rad'}" for i, k in enumerate(scale)
                    ]
                }
            values = [0 if self.chance(0.2) else float(1 / k) for k in scale]
            return {"compliance": values}
        Q = np.linalg.qr(self.rng.normal(size=(6, 6)))[0]
        M = np.sqrt(scale)[:, None] * ((Q * self.rng.uniform(0.3, 3, 6)) @ Q.T) * np.sqrt(scale)
        M = (M + M.T) / 2
        if not stiffness:
            M = np.linalg.inv(M)
            M = (M + M.T) / 2
        return {"stiffness" if stiffness else "compliance": M.tolist()}

    def drive(self, slides: bool) -> dict[str, Any]:
        role = self.one(["actuated", "actuated", "locked"])
        k = float(np.exp(self.rng.uniform(0, 3))) * (1e7 if slides else 1e7 * self.size**2)
        own: dict[str, Any] = {"role": role}
        if self.chance(0.85):
            own["stiffness"] = self._in(k, _SLIDES if slides else _TURNS)
        return own

    def joint(self, passive: bool, home: float = 0.6) -> dict[str, Any]:
        kinds = ["revolute", "revolute", "prismatic", "helical"]
        kind = self.one(
            [*kinds, "universal", "spherical", "cylindrical", "planar"] if passive else kinds
        )
        own: dict[str, Any] = {
            "type": kind,
            **({"role": "passive"} if passive else self.drive(kind == "prismatic")),
        }
        angles = [self.angle(float(x)) for x in self.rng.uniform(-home, home, 3)]
        slides = [self.length(float(x)) for x in self.rng.uniform(-0.3, 0.3, 2) * self.size]
        if kind in ("revolute", "prismatic", "helical"):
            own |= {"axis": self.unit(), "home": slides[0] if kind == "prismatic" else angles[0]}
        if kind == "helical":
            own["pitch"] = self.length(float(self.rng.uniform(-0.05, 0.05)))
        if kind == "universal":
            own |= {
                "axes": self.one([["x", "y"], ["z", [1, 1, 0]], [[1, 0.2, 0], "-z"]]),
                "home": angles[:2],
            }
        if kind == "spherical":
            own["home"] = angles
        if kind == "cylindrical":
            own |= {"axis": self.unit(), "home": [slides[0], angles[0]]}
        if kind == "planar":
            own |= {"normal": self.one("xyz"), "home": [*slides, angles[0]]}
        return own

    def rod(self, **own: Any) -> dict[str, Any]:
        return {**own, "material": self.material(), "section": self.section(shear=True)}

    def telescope(self) -> dict[str, Any]:
        own: dict[str, Any] = {
            "type": "telescope",
            "direction": self.unit(),
            "y_axis": [0.31, 0.77, -0.2],
            **self.drive(True),
        }
        own["home"] = self.length(float(self.rng.uniform(0.4, 0.8)) * self.size)
        beams = [self.rod(fixed=self.length(0.7 * self.size)), self.rod(share=1)]
        if self.chance(0.4):
            fixed = self.length(0.2 * self.size)
            beams = [self.rod(share=0.25), self.rod(share=0.75, fixed=fixed)]
        own["beams"] = (
            beams if self.chance(0.8) else beams[1:] if beams[1].get("share") == 1 else beams
        )
        if self.chance(0.3):
            own["beams"][0]["theory"] = "timoshenko"
        return own

    def elastic(self) -> dict[str, Any]:
        kind = self.one(["beam", "beam", "spring", "link", "telescope"])
        if kind == "beam":
            return self.beam(
                [self.length(float(x)) for x in self.rng.uniform(0.2, 1, 3) * self.size]
            )
        if kind == "telescope":
            return self.telescope()
        own = {"type": kind, **self.matrix(self.chance(0.5)), **self.rotation()}
        own["to" if kind == "link" else "at"] = self.point()
        return own

    def chain(self, passive: float, count: int) -> list[dict[str, Any]]:
        parts = []
        for _ in range(count):
            if self.chance(0.55):
                parts.append(self.joint(self.chance(passive)))
            elif self.chance(0.7):
                parts.append(self.elastic())
            else:
                parts.append({"type": "rigid", "to": self.point(), **self.rotation()})
        parts.append(self.elastic())
        for i, part in enumerate(parts):
            part["name"] = f"part {i}"
        return parts

    def block(self) -> dict[str, Any]:
        """Two or three branches that end where the first one does."""
        branches, first = [], None
        for i in range(int(self.rng.integers(2, 4))):
            own = {"name": "xyz"[i], "start": self.frame()}
            own |= self.coupled(self.chain(0.6, int(self.rng.integers(2, 5))))
            end = _end(own, own["start"])
            first = end if first is None else first
            branches.append({**own, "end": _frame_data(np.linalg.inv(first) @ end)})
        return {"type": "parallel", "name": "block", "branches": branches}

    def coupled(self, chain: list[dict[str, Any]], share: float = 0.8) -> dict[str, Any]:
        """A chain, and gears, belts and differentials of its joints, each with a follower."""
        single = [p for p in chain if p["type"] in ("revolute", "prismatic", "helical")]
        followers = [p for p in single if p["role"] == "passive"]
        couplings = []
        for first in followers:
            others = [p for p in single if p is not first]
            if not others or not self.chance(share):
                continue
            slides = first["type"] == "prismatic"
            terms = {first["name"]: self.one([1, float(self.rng.uniform(0.5, 2))])}
            for other in self.rng.choice(len(others), min(2, len(others)), replace=False):
                unit = {(True, False): 0.05, (False, True): 20.0}
                own = others[other]["type"] == "prismatic"
                factor = float(self.rng.uniform(-2, 2)) * unit.get((slides, own), 1.0)
                terms[others[other]["name"]] = factor
            own = {"sum": terms, "role": self.one(["locked", "locked", "actuated"])}
            if self.chance(0.3):
                leader = self.one(others)
                ratio = float(self.rng.uniform(-2, 2))
                offset = number(first["home"], {}) - ratio * number(leader["home"], {})
                own = {"joint": first["name"], "follows": leader["name"], "ratio": ratio}
                own["offset"] = offset
            if self.chance(0.6):
                own["stiffness"] = "2e5 N/m" if slides else "3e4 N m/rad"
            couplings.append(own)
        return {"chain": chain, "couplings": couplings} if couplings else {"chain": chain}


def _written(name: str, **own: Any) -> str:
    data = {"robostiff": 1, "name": name, "source": "drawn at random", **own}
    dumper = yaml.SafeDumper
    dumper.ignore_aliases = lambda *_: True  # type: ignore[method-assign]
    return yaml.dump(data, sort_keys=False, Dumper=dumper)


def _end(leg: dict[str, Any], base: dict[str, Any]) -> np.ndarray:
    """Where a chain ends at home."""
    own = {"name": "leg", "base": base, "chain": leg["chain"], "platform": {}}
    machine = Machine("leg.yaml", text=_written("leg", legs=[own]))
    return machine._walk(machine.legs[0], np.eye(4), machine.homes, [])[0]


def _frame_data(T: np.ndarray) -> dict[str, Any]:
    return {"at": T[:3, 3].tolist(), "rotation_vector": rotation_vector(T[:3, :3]).tolist()}


def arm(rng: np.random.Generator) -> str:
    """A serial arm posed by its joints, perhaps with passive joints and with couplings."""
    draw = Draw(rng)
    chain = draw.coupled(draw.chain(0.15 if draw.chance(0.6) else 0.4, int(rng.integers(3, 9))))
    leg: dict[str, Any] = {"name": "arm", "base": draw.frame(), **chain}
    return _written("arm", legs=[leg], reference_point=draw.point(0.2))


def platform(rng: np.random.Generator) -> str:
    """A platform on two to four legs that close at home."""
    draw = Draw(rng)
    home = draw.frame()
    if not any(key in home for key in ("turn", "rotation_vector", "matrix", "axes")):
        home["turn"] = [{"z": "20 deg"}]
    P, legs = np.linalg.inv(frame(home, {})), []
    for i in range(int(rng.integers(2, 5))):
        chain, base = draw.chain(0.75, int(rng.integers(2, 7))), draw.frame()
        if draw.chance(0.15):
            chain.insert(int(rng.integers(len(chain) + 1)), draw.block())
        own = draw.coupled(chain, 0.3)
        end = _frame_data(P @ _end(own, base))
        legs.append({"name": f"leg {i}", "base": base, **own, "platform": end})
    return _written("platform", home=home, legs=legs, reference_point=draw.point(0.2))


_MODULES = [
    "hexapod",
    "delta",
    "3-prs",
    "3-rps",
    "gough-stewart-b",
    "orthoglide",
    "tripteron",
    "h4",
    "capaman",
    "t3r1",
    "hexaglide",
    "3-upu",
    "us-ups",
    "3-rpr-beams",
    "agile-eye",
    "hexa",
    "3-puu",
]


def machine(rng: np.random.Generator) -> str:
    """Modules in series: shipped robots and chains."""
    draw = Draw(rng)
    modules: list[dict[str, Any]] = []
    for i in range(int(rng.integers(2, 4))):
        own: dict[str, Any] = {"name": f"module {i}"}
        if draw.chance(0.7):
            own["mount"] = draw.frame(0.3)
        if (draw.chance(0.5) and any("robot" in m for m in modules) is False) or (
            i == 0 and draw.chance(0.5)
        ):
            own["robot"] = draw.one(_MODULES)
            if own["robot"] in ("hexapod", "delta") and draw.chance(0.6):
                own["parameters"] = {"R": "Rb"}
        else:
            own["chain"] = draw.chain(0.0, int(rng.integers(1, 4)))
        modules.append(own)
    more: dict[str, Any] = {"reference_point": draw.point(0.2)} if draw.chance(0.5) else {}
    return _written(
        "machine", parameters={"Rb": f"{rng.uniform(0.21, 0.6):.4f} m"}, modules=modules, **more
    )
