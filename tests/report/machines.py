"""Robots by name, as robots."""

import robostiff as rs


def with_symbols(name: str) -> rs.Robot:
    """A shipped robot whose parameters are symbols."""
    return rs.load(name, symbols=rs.ALL_PARAMETERS)
