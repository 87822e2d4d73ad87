"""The page of a robot or of a result of any kind."""

from __future__ import annotations

from typing import Any

from robostiff.analysis import CableResponse, CableStiffness, Deflection, Stiffness
from robostiff.analysis.indices import StiffnessIndices
from robostiff.analysis.verification import Verification
from robostiff.compensation.compensate import Compensation
from robostiff.identification.identified import Identified
from robostiff.markup import Page
from robostiff.model import Robot
from robostiff.page.cables import cable_response_page, cable_stiffness_page
from robostiff.page.compensation import compensation_page
from robostiff.page.facts import robot_page
from robostiff.page.identification import identification_page
from robostiff.page.indices import indices_page
from robostiff.page.loads import equilibrium_page, modes_page
from robostiff.page.stiffness import deflection_page, stiffness_page, verification_page
from robostiff.statics import Equilibrium, Modes

_WRITERS: dict[type, Any] = {
    Robot: robot_page,
    Stiffness: stiffness_page,
    Deflection: deflection_page,
    Verification: verification_page,
    StiffnessIndices: lambda found: indices_page(found.result, found),
    CableStiffness: cable_stiffness_page,
    CableResponse: cable_response_page,
    Equilibrium: equilibrium_page,
    Modes: modes_page,
    Compensation: compensation_page,
    Identified: identification_page,
}


def page_of(result: object) -> Page:
    """The page of a robot or of a result; of a batch in short.

    Examples
    --------
    >>> import robostiff as rs
    >>> page = page_of(rs.stiffness(rs.load("3-rrr")))
    >>> page.name, page.data["rank"]
    ('3-rrr', 3)
    """
    if getattr(result, "batch_shape", ()) and not isinstance(result, Compensation):
        return Page(repr(result))
    return next(_WRITERS[kind] for kind in type(result).__mro__ if kind in _WRITERS)(result)
