"""Reports: robot, stiffness, deflection, workspace, method and formula on one page.

A page of HTML holds everything that it shows, so that it opens years later and without a network.
``contents`` computes, ``results`` and ``the_robot`` describe, ``write`` makes HTML, and Typst for
PDF.
"""

from robostiff.report.contents import NO_TITLE_BLOCK as NO_TITLE_BLOCK
from robostiff.report.contents import DescribedBy as DescribedBy
from robostiff.report.contents import ReportContents as ReportContents
from robostiff.report.contents import TitleBlock as TitleBlock
from robostiff.report.contents import described_by as described_by
from robostiff.report.contents import report_contents as report_contents
from robostiff.report.write import report_html as report_html
from robostiff.report.write import report_page as report_page
from robostiff.report.write import report_path as report_path
from robostiff.report.write import report_pdf as report_pdf
from robostiff.report.write import report_typst as report_typst
from robostiff.report.write import save_report as save_report
from robostiff.report.write import write_report as write_report
