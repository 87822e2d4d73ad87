"""Exact arithmetic on expressions: polynomials over symbols, roots, sines and cosines."""
