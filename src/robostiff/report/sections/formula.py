"""The formula of the stiffness matrix, typeset."""

from __future__ import annotations

from robostiff.markup import Words
from robostiff.report.contents import ReportContents
from robostiff.report.section import Folded, Formula, Section, section


def formula_section(contents: ReportContents) -> Section:
    """The derivation step by step, or why there is none."""
    derivation = contents.derivation
    title = "The formula"
    if derivation is None:
        return section("formula", title, [Words(f"There is no formula: {contents.no_derivation}.")])
    words = "How the stiffness matrix comes about in the home configuration, step by step"
    return section("formula", title, [Folded(words, (Formula(derivation),))])
