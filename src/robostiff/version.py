"""Version of robostiff."""

__version__ = "0.1.0"
