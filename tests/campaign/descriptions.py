"""Descriptions."""


def described(rng):
    return []
