"""A robot at its pose: legs closed in formulas, and compared with numbers."""
