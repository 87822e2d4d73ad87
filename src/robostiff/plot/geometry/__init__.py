"""Geometry of drawings: legs, displaced bodies, ellipsoids, screws, surfaces."""
