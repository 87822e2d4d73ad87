"""Model files: robots in YAML, with units, named parameters and patterns for repeated legs.

Classes ``Written*`` say what may be written (pydantic models), functions ``build_*`` make parts of
robots of it. The entry point is ``build``; ``written_*`` have the whole file and common keys.
Every error gives file, line, column and path.
"""

from robostiff.io.model_file.build import model_from_document
from robostiff.io.model_file.symbols import ALL_PARAMETERS, ParameterChoice

__all__ = ["ALL_PARAMETERS", "ParameterChoice", "model_from_document"]
