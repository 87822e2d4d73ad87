"""What a drawing needs to know of shapes: legs, displaced bodies, ellipsoids, screws, surfaces."""
