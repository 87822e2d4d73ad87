"""Legs as sums of springs: unit wrenches, each with a compliance in contributions."""
