"""Results as text, as plain data for JSON, and as files of MATLAB."""

from robostiff.io.results.stiffness import (
    deflection_data,
    deflection_text,
    stiffness_data,
    stiffness_text,
)

__all__ = ["deflection_data", "deflection_text", "stiffness_data", "stiffness_text"]
