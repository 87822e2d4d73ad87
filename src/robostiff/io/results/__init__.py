"""Results as JSON data and as text."""

from robostiff.io.results.data import deflection_data, stiffness_data
from robostiff.io.results.text import deflection_text, stiffness_text

__all__ = ["deflection_data", "deflection_text", "stiffness_data", "stiffness_text"]
