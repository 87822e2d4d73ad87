"""Reports: robot, stiffness, deflection, workspace, method and formula on one page.

A page of HTML holds everything that it shows, so that it opens years later and without a network.
``contents`` computes, ``results`` and ``the_robot`` describe, ``write`` makes HTML, and Typst for
PDF.
"""

from robostiff.report.contents import (
    NO_TITLE_BLOCK,
    DescribedBy,
    ReportContents,
    TitleBlock,
    described_by,
    report_contents,
)
from robostiff.report.write import (
    report_html,
    report_page,
    report_path,
    report_pdf,
    report_typst,
    save_report,
    write_report,
)

__all__ = [
    "NO_TITLE_BLOCK",
    "DescribedBy",
    "ReportContents",
    "TitleBlock",
    "described_by",
    "report_contents",
    "report_html",
    "report_page",
    "report_path",
    "report_pdf",
    "report_typst",
    "save_report",
    "write_report",
]
