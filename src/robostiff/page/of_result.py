"""The page of a robot or of a result of any kind."""

from __future__ import annotations

from importlib import import_module

from robostiff.markup import Page

# The module and function of this package that write the page of a kind of result. They are imported
# with the first page of that kind, as they import the questions that it answers.
_WRITERS = {
    "Subject": ("facts", "machine_page"),
    "Stiffness": ("stiffness", "stiffness_page"),
    "Deflection": ("stiffness", "deflection_page"),
    "Verification": ("stiffness", "verification_page"),
    "StiffnessIndices": ("indices", "indices_page"),
    "CableStiffness": ("cables", "cable_stiffness_page"),
    "CableResponse": ("cables", "cable_response_page"),
    "Equilibrium": ("loads", "equilibrium_page"),
    "CriticalLoad": ("loads", "critical_page"),
    "Modes": ("loads", "modes_page"),
    "NetworkResponse": ("loads", "response_page"),
    "Compensation": ("compensation", "compensation_page"),
    "Identified": ("identification", "identification_page"),
    "Optimum": ("design", "optimum_page"),
    "Tolerances": ("design", "tolerances_page"),
    "Dataset": ("maps", "map_page"),
}


def page_of(result: object) -> Page:
    """The page of a machine or of a result; of a batch in short.

    Examples
    --------
    >>> import robostiff as rs
    >>> page = page_of(rs.stiffness(rs.load("3-rrr")))
    >>> page.name, page.data["rank"]
    ('3-rrr', 3)
    """
    kinds = [kind.__name__ for kind in type(result).__mro__]
    if getattr(result, "batch_shape", ()) and "Compensation" not in kinds:
        return Page(repr(result))
    module, function = next(_WRITERS[kind] for kind in kinds if kind in _WRITERS)
    return getattr(import_module(f"robostiff.page.{module}"), function)(result)
