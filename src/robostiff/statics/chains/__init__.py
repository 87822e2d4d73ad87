"""Legs as chains of elements in finite motion: joints, beams, springs, and their tangents."""
