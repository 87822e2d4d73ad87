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
    "sphinx.ext.viewcode",
    "sphinxcontrib.bibtex",
    "sphinx_gallery.gen_gallery",
    "derived_formulas",
    "mathml",
    "offered_names",
]

exclude_patterns = ["_build", "_ext", "gallery/*.ipynb", "gallery/*.py"]
html_theme = "furo"
html_title = "robostiff"
html_static_path = ["_static"]
html_css_files = ["robostiff.css"]
html_math_renderer = "mathml"

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence", "deflist"]
myst_heading_anchors = 3
myst_dmath_double_inline = True

bibtex_bibfiles = ["references.bib"]
bibtex_default_style = "plain"

# The files of examples/, run; their pictures are caught by _ext/pictures_of_examples.py.
sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "image_scrapers": ("pictures_of_examples.keep_pictures",),
    "reset_modules": (),
    "capture_repr": (),
    "run_stale_examples": True,  # the library may have changed
    "notebook_extensions": (),
    "within_subsection_order": "pictures_of_examples.first_page_first",
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
    "min_reported_time": 3600,
    "abort_on_example_error": True,
    "remove_config_comments": True,
}

# Shapes and units are given in the docstrings; the annotations of arrays would hide the names.
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
