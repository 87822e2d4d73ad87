"""Model files: robots in YAML, with units, named parameters and patterns for repeated legs.

Classes ``Written*`` say what may be written (pydantic models), and ``build`` of each makes the part
of a robot of it, at its place in the file: every error gives file, line, column and path.
``model_from_document`` is the entry point; ``at_home`` verifies what was built.
"""

from robostiff.io.model_file.robots import model_from_document as model_from_document
from robostiff.io.model_file.symbols import ALL_PARAMETERS as ALL_PARAMETERS
from robostiff.io.model_file.symbols import ParameterChoice as ParameterChoice
