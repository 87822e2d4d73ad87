"""Compensation: commands that bring a loaded robot to the wanted path."""
