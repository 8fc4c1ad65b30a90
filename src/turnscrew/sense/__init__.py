"""Simulated sensors: they take the truth and a clock and return what the robot gets to see of it."""
