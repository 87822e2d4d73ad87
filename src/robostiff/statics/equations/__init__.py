"""The equations of a robot under load: equilibrium, closure, stability, critical points."""
