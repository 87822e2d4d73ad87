"""Equilibria of robots under load as records, to be evaluated at many poses and wrenches."""
