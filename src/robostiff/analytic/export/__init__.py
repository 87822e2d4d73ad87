"""Export of derivations: text, LaTeX, Markdown, HTML, Typst, PDF, JSON, and functions.

Plain text, LaTeX, Markdown, HTML and Typst (PDF) show how a stiffness matrix came about; JSON data
have it with expressions as text; functions of Python, C, Julia and MATLAB compute it.
"""

from robostiff.analytic.export.documents import derivation_data as derivation_data
from robostiff.analytic.export.documents import derivation_html as derivation_html
from robostiff.analytic.export.documents import derivation_latex as derivation_latex
from robostiff.analytic.export.documents import derivation_markdown as derivation_markdown
from robostiff.analytic.export.documents import derivation_page as derivation_page
from robostiff.analytic.export.documents import derivation_pdf as derivation_pdf
from robostiff.analytic.export.documents import derivation_text as derivation_text
from robostiff.analytic.export.documents import derivation_typst as derivation_typst
from robostiff.analytic.export.documents import latex_snippet as latex_snippet
from robostiff.analytic.export.languages_of_code import c_function as c_function
from robostiff.analytic.export.languages_of_code import julia_function as julia_function
from robostiff.analytic.export.languages_of_code import matlab_function as matlab_function
from robostiff.analytic.export.languages_of_code import python_function as python_function
