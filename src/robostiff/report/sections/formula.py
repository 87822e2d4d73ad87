"""The formula of the stiffness matrix, typeset."""

from __future__ import annotations

from robostiff.analytic.export import derivation_html
from robostiff.markup import element, escaped
from robostiff.report.contents import ReportContents
from robostiff.report.section import Section, section


def formula_section(contents: ReportContents) -> Section:
    """The derivation step by step, or why there is none."""
    derivation = contents.derivation
    title = "The formula"
    if derivation is None:
        why = f"There is no formula: {contents.no_derivation}."
        return section("formula", title, element("p", escaped(why)))
    words = "How the stiffness matrix comes about in the home configuration, step by step"
    body = derivation_html(derivation, first_heading=3)
    return section("formula", title, element("details", element("summary", words) + body))
