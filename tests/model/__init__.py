"""Tests of the model: frames, formulas in place of numbers, symbols of a robot."""
