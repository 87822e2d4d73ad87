"""The picture that notebooks show below the tables of a result."""

from __future__ import annotations

from base64 import b64encode
from contextlib import suppress
from io import BytesIO
from typing import Any, cast

from robostiff.analysis import Deflection, Stiffness
from robostiff.compensation.compensate import Compensation
from robostiff.elastostatics import Status
from robostiff.errors import NoAnswerError
from robostiff.identification.identified import Identified
from robostiff.markup import escaped
from robostiff.model.subject import Subject
from robostiff.plot.backend import DATA, Matplotlib
from robostiff.plot.bars_and_curves import compensation_picture, residuals_picture
from robostiff.plot.picture import Picture
from robostiff.plot.posed_robot import equilibrium, mode, picture_of_posed, robot
from robostiff.plot.stiffness_pictures import ellipsoid
from robostiff.statics import Equilibrium, Modes

_DPI = 150  # twice that of most screens


def picture_html(result: object) -> str:
    """The picture of a result as an ``<img>``; empty where there is none.

    Raises InputError when Matplotlib is missing.
    """
    picture = None
    with suppress(NoAnswerError):
        picture = picture_of_result(result)
    if picture is None:
        return ""
    figure: Any = Matplotlib().draw(picture).figure
    written = BytesIO()
    figure.savefig(written, format="png", dpi=_DPI)
    data = b64encode(written.getvalue()).decode("ascii")
    style = f"max-width: 100%; width: {figure.get_figwidth():.2f}in"
    return (
        f'<img alt="{escaped(picture.title)}" style="{style}" src="data:image/png;base64,{data}">'
    )


def picture_of_result(result: object) -> Picture | None:
    """The machine, its compliance ellipsoid, its deformed shape, its slowest mode, or curves.

    None for batches, and where the result does not know its robot.
    """
    match result:
        case Subject():
            picture = robot(getattr(result, "numeric", cast("Any", result)), backend=DATA)
        case Stiffness() if _is_posed(result):
            picture = ellipsoid(result, within=result.placed(), backend=DATA)
        case Deflection(stiffness=Stiffness() as posed) if _is_posed(posed):
            # the shape under forces at bodies is not known from the wrench
            drawable = result.has_answer and result.work_of_loads is None
            picture = picture_of_posed(posed.placed(), result) if drawable else None
        case Equilibrium(batch_shape=()) if result.has_answer:
            picture = equilibrium(result, backend=DATA)
        case Modes(batch_shape=()) if len(result):
            picture = mode(result, backend=DATA)
        case Identified() if not result.fit.too_few:
            picture = residuals_picture(result)
        case Compensation() if len(result.target):
            picture = compensation_picture(result)
        case _:
            picture = None
    return picture


def _is_posed(result: Stiffness) -> bool:
    """Whether it is of a single pose that the robot reaches."""
    return not result.batch_shape and Status.UNREACHABLE not in result.status
