"""Sphinx configuration."""

import sys
from pathlib import Path

import robostiff

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

project = "robostiff"
author = "The robostiff developers"
copyright = "The robostiff developers"
version = release = robostiff.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
    "sphinxcontrib.bibtex",
    "derived_formulas",
]

exclude_patterns = ["_build", "_ext"]
html_theme = "furo"
html_title = "robostiff"
html_static_path = ["_static"]

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
myst_dmath_double_inline = True

bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "plain"

# Shapes and units are told in the docstrings; the annotations of arrays would hide the names.
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": False}
autoclass_content = "class"
napoleon_google_docstring = False
napoleon_numpy_docstring = True
napoleon_use_ivar = True
napoleon_use_rtype = False
default_role = "code"
add_module_names = False

# Shapes such as "(size,) array" name no object; Sphinx looks for one and finds several.
suppress_warnings = ["ref.python"]
