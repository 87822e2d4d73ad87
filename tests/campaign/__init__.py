"""Random robots, files and stores through every way to an answer; ``python -m tests.campaign``."""
