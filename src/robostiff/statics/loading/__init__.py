"""What is loaded and by what: robots, networks and cables at a pose, loads, force laws."""
