"""One page that answers: what the robot is, how stiff, where it gives way, and how that was found.

A page of HTML holds everything that it shows, so that it opens years later and without a network.
``contents`` computes, ``sections`` tells, ``page`` puts together.
"""

from robostiff.report.contents import ReportContents, report_contents
from robostiff.report.page import report_html
from robostiff.report.write import save_report, write_report

__all__ = ["ReportContents", "report_contents", "report_html", "save_report", "write_report"]
