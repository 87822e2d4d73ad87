"""Identification: parameters of a robot from measurements, and where to measure."""
