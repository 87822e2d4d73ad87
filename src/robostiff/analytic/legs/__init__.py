"""One leg at a time: passive joints eliminated by name, and what a load adds."""
