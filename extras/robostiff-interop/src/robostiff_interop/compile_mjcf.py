"""The task of the child process in which MuJoCo compiles; imports nothing of this package."""

from __future__ import annotations

from typing import Any

import mujoco as _mujoco
import numpy as np

mujoco: Any = _mujoco  # a module in C without annotations

_ARRAYS = (
    *("body_parentid", "body_jntadr", "body_jntnum", "body_pos", "body_quat"),
    *("jnt_type", "jnt_bodyid", "jnt_qposadr", "jnt_limited", "jnt_range", "jnt_pos", "jnt_axis"),
    *("qpos0", "qpos_spring", "site_bodyid", "site_pos", "site_quat"),
    *("body_mass", "body_ipos", "body_iquat", "body_inertia", "jnt_dofadr"),
    *("actuator_trntype", "actuator_trnid", "actuator_biastype", "actuator_gear"),
    *("eq_type", "eq_objtype", "eq_obj1id", "eq_obj2id", "eq_active0", "eq_data"),
)


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Names and arrays of the model of a text, or the reason of a failure."""
    try:
        spec = mujoco.MjSpec.from_string(request["text"])
        unread = _without_shapes_of_files(spec)
        for bound in ("boundmass", "boundinertia"):
            setattr(spec.compiler, bound, max(getattr(spec.compiler, bound), request["nothing"]))
        model = spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        return {"refusal": str(error)}
    return {**names_and_arrays(model), "without_mass": unread}


def _without_shapes_of_files(spec: Any) -> list[str]:
    """Delete the shapes that other files have; names of the bodies whose masses they decide."""
    of_files = {getattr(mujoco.mjtGeom, f"mjGEOM_{name}") for name in ("MESH", "HFIELD", "SDF")}
    first, last = spec.compiler.inertiagrouprange
    groups, named = range(first, last + 1), []
    from_shapes = int(spec.compiler.inertiafromgeom)
    for geom in list(spec.geoms):
        if geom.type not in of_files and not geom.meshname and not geom.hfieldname:
            continue
        body = geom.parent
        asked = from_shapes == 1 or (from_shapes == 2 and not body.explicitinertial)
        weighs = geom.mass != 0 and geom.density != 0 and geom.group in groups
        if asked and weighs and body.name != "world":
            named.append(body.name)
        spec.delete(geom)
    return list(dict.fromkeys(named))


def names_and_arrays(model: Any) -> dict[str, Any]:
    """What is read of a compiled model, as plain data."""
    armature = model.dof_armature.copy()
    for i, inertia in enumerate(getattr(model, "actuator_armature", ())):  # of newer versions
        if model.actuator_trntype[i] in (0, 1):  # on joints
            dof = model.jnt_dofadr[model.actuator_trnid[i][0]]
            armature[dof] += inertia * model.actuator_gear[i][0] ** 2
    return {
        "name": bytes(model.names).split(b"\0", 1)[0].decode(),
        "bodies": [model.body(i).name for i in range(model.nbody)],
        "joints": [model.joint(i).name for i in range(model.njnt)],
        "sites": [model.site(i).name for i in range(model.nsite)],
        "equalities": [model.equality(i).name for i in range(model.neq)],
        # Newer versions have coefficients of higher powers, here or in another array.
        "jnt_stiffness": [model.joint(i).stiffness.flat[0] for i in range(model.njnt)],
        "jnt_stiffnesspoly": getattr(
            model, "jnt_stiffnesspoly", np.zeros((model.njnt, 1))
        ).tolist(),
        "actuator_biasprm": model.actuator_biasprm[:, :2].tolist(),
        **{key: getattr(model, key).tolist() for key in _ARRAYS},
        "dof_armature": armature.tolist(),
    }
