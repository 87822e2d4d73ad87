"""Models as MuJoCo compiles them, from the kinematic part of a file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from robostiff.errors import FileError, Location, needs_extra
from robostiff.io.child_process import COMPILE_MJCF, answer_of
from robostiff.io.mjcf.kinematic_part import kinematic_part
from robostiff.io.plausibility import warn_of_parts_not_read
from robostiff.io.suggest import Words

_LINE = re.compile(r",? line (\d+)")
_REAL = frozenset(
    (
        *("body_pos", "body_quat", "site_pos", "site_quat", "jnt_pos", "jnt_axis", "jnt_range"),
        *("jnt_stiffness", "qpos0", "qpos_spring", "eq_data", "actuator_biasprm", "actuator_gear"),
        *("body_mass", "body_ipos", "body_iquat", "body_inertia", "dof_armature"),
    )
)


NOTHING = 1e-12
"""Mass and moments of a body without any, as MuJoCo compiles no other [kg], [kg m^2]."""


@dataclass(frozen=True)
class CompiledModel:
    """The compiled model of a file."""

    name: str
    # their names, empty where they have none
    bodies: tuple[str, ...]
    joints: tuple[str, ...]
    sites: tuple[str, ...]
    equalities: tuple[str, ...]
    arrays: dict[str, np.ndarray]  # those of MuJoCo's own model, by the same names

    def __getattr__(self, key: str) -> np.ndarray:
        """An array of MuJoCo's model."""
        try:
            return self.__dict__["arrays"][key]
        except KeyError:
            raise AttributeError(key) from None


def compiled_model(source: Path | str) -> CompiledModel:
    """The MuJoCo model of a file without what is seen or touched, and the shapes of other files."""
    lines = kinematic_part(source)
    with needs_extra("MJCF files", "mjcf"):
        if find_spec("mujoco") is None:  # another process imports it
            raise ModuleNotFoundError(name="mujoco")
    try:
        return _compiled("\n".join(tag for tag, _ in lines), str(source))
    except FileError as error:
        raise _in_its_line(error, [place for _, place in lines]) from None


@lru_cache(maxsize=64)
def _compiled(text: str, file: str) -> CompiledModel:
    place, request = Location(file), {"text": text, "nothing": NOTHING}
    return _from_data(answer_of(COMPILE_MJCF, request, place, "MJCF", "MuJoCo"), place)


def read_model(model: Any) -> CompiledModel:
    """Names and arrays of an ``mujoco.MjModel``."""
    from robostiff.io.child_process.compile_mjcf import names_and_arrays

    data = names_and_arrays(model)
    place = Location(f"model of MuJoCo {data['name']!r}")
    on_tendons = model.actuator_trntype == _ON_TENDONS
    moving = {
        "tendons": [
            model.tendon(i).name or str(i)
            for i in range(model.ntendon)
            if np.any(model.tendon_stiffness[i])
            or model.tendon_limited[i]
            or i in model.actuator_trnid[on_tendons, 0]
        ],
        "drives of sites or bodies": [
            model.actuator(i).name or str(i)
            for i in range(model.nu)
            if model.actuator_trntype[i] not in (*ON_JOINTS, _ON_TENDONS)
        ],
        "plugins": [str(i) for i in range(model.nplugin)],
        "flexible bodies": [str(i) for i in range(model.nflex)],
    }
    warn_of_parts_not_read({kind: [(n, place) for n in names] for kind, names in moving.items()})
    return _from_data(data, place)


ON_JOINTS, _ON_TENDONS = (0, 1), 3
"""Kinds of transmission, as of ``mujoco.mjtTrn``."""


def _from_data(data: dict[str, Any], place: Location) -> CompiledModel:
    names = {key: data.pop(key) for key in ("bodies", "joints", "sites", "equalities")}
    name, without = data.pop("name"), data.pop("without_mass", [])
    unread = {"the masses of meshes of": [(body, place) for body in without]}
    warn_of_parts_not_read(unread, "bodies have those of other shapes")
    arrays = {key: _array(key, values, place) for key, values in data.items()}
    return CompiledModel(
        name,
        **{key: tuple(map(str, listed)) for key, listed in names.items()},
        arrays=arrays,
    )


def _array(key: str, values: Any, place: Location) -> np.ndarray:
    array = np.array(values, dtype=float if key in _REAL else np.int64)
    if not np.isfinite(array).all():
        raise FileError(
            place,
            "MJCF",
            got=Words(f"a model with a {key} that is no number"),
            expected="finite places, axes and coordinates",
        )
    array.setflags(write=False)
    return array


def _in_its_line(error: FileError, places: Sequence[Location]) -> FileError:
    """The error at the location of the file to which MuJoCo's line number belongs."""
    found = _LINE.search(str(error.got))
    if error.location.line is not None or not found or not 0 < int(found[1]) <= len(places):
        return error
    words = Words(_LINE.sub("", str(error.got)).strip())
    return FileError(places[int(found[1]) - 1], error.subject, got=words, expected=error.expected)
