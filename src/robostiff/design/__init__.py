"""Design: the best values of parameters, and what their tolerances do."""
