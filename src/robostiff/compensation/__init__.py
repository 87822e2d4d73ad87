"""Compensation: commands by which a loaded robot is where it is wanted."""
