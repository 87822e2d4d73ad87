"""Export of derivations: text, LaTeX, Markdown, HTML, Typst, PDF, JSON, and functions.

Plain text, LaTeX, Markdown, HTML and Typst (PDF) show how a stiffness matrix came about; JSON data
have it with expressions as text; functions of Python, C, Julia and MATLAB compute it.
"""

from robostiff.analytic.export.documents import (
    derivation_data,
    derivation_html,
    derivation_latex,
    derivation_markdown,
    derivation_page,
    derivation_pdf,
    derivation_text,
    derivation_typst,
    latex_snippet,
)
from robostiff.analytic.export.languages_of_code import (
    c_function,
    julia_function,
    matlab_function,
    python_function,
)

__all__ = [
    "c_function",
    "derivation_data",
    "derivation_html",
    "derivation_latex",
    "derivation_markdown",
    "derivation_page",
    "derivation_pdf",
    "derivation_text",
    "derivation_typst",
    "julia_function",
    "latex_snippet",
    "matlab_function",
    "python_function",
]
