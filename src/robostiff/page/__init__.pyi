from robostiff.page.facts import facts_of, facts_page, machine_page
from robostiff.page.indices import indices_page, principal_table
from robostiff.page.loads import equilibrium_page, modes_page, response_page
from robostiff.page.of_result import page_data, page_of, robots_page
from robostiff.page.stiffness import (
    cable_load_blocks,
    cable_response_page,
    cable_stiffness_page,
    deflection_page,
    displacement_table,
    energy_table,
    stiffness_page,
    verification_page,
)

__all__ = [
    "cable_load_blocks",
    "cable_response_page",
    "cable_stiffness_page",
    "deflection_page",
    "displacement_table",
    "energy_table",
    "equilibrium_page",
    "facts_of",
    "facts_page",
    "indices_page",
    "machine_page",
    "modes_page",
    "page_data",
    "page_of",
    "principal_table",
    "response_page",
    "robots_page",
    "stiffness_page",
    "verification_page",
]
