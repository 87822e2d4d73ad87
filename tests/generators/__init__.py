"""Random chains and robots, and references that the tests share."""
