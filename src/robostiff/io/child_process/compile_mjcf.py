"""The task of the child process in which MuJoCo compiles; imports nothing of this package."""

from __future__ import annotations

from typing import Any

import mujoco as _mujoco

mujoco: Any = _mujoco  # a module in C without annotations

_ARRAYS = (
    *("body_parentid", "body_jntadr", "body_jntnum", "body_pos", "body_quat"),
    *("jnt_type", "jnt_bodyid", "jnt_qposadr", "jnt_limited", "jnt_range", "jnt_pos", "jnt_axis"),
    *("qpos0", "qpos_spring", "site_bodyid", "site_pos", "site_quat"),
    *("actuator_trntype", "actuator_trnid", "actuator_biastype", "actuator_gear"),
    *("eq_type", "eq_objtype", "eq_obj1id", "eq_obj2id", "eq_active0", "eq_data"),
)


def answer(request: dict[str, Any]) -> dict[str, Any]:
    """Names and arrays of the model of a text without shapes, or the reason of a failure."""
    try:
        spec = mujoco.MjSpec.from_string(request["text"])
        # Bodies have no mass without their shapes.
        spec.compiler.boundmass = spec.compiler.boundinertia = 1.0
        model = spec.compile()
    except (ValueError, RuntimeError, mujoco.FatalError) as error:
        return {"refusal": str(error)}
    return names_and_arrays(model)


def names_and_arrays(model: Any) -> dict[str, Any]:
    """What is read of a compiled model, as plain data."""
    return {
        "name": bytes(model.names).split(b"\0", 1)[0].decode(),
        "bodies": [model.body(i).name for i in range(model.nbody)],
        "joints": [model.joint(i).name for i in range(model.njnt)],
        "sites": [model.site(i).name for i in range(model.nsite)],
        "equalities": [model.equality(i).name for i in range(model.neq)],
        # Newer versions have coefficients of higher powers, here or in another array.
        "jnt_stiffness": [model.joint(i).stiffness.flat[0] for i in range(model.njnt)],
        "actuator_biasprm": model.actuator_biasprm[:, :2].tolist(),
        **{key: getattr(model, key).tolist() for key in _ARRAYS},
    }
