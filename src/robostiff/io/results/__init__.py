"""Results as text, as plain data for JSON, and as files of MATLAB."""

from robostiff.io.results.plain_data import deflection_data, stiffness_data
from robostiff.io.results.text import deflection_text, stiffness_text

__all__ = ["deflection_data", "deflection_text", "stiffness_data", "stiffness_text"]
