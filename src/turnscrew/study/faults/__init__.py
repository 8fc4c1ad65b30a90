"""Sensors that fail in the middle of a run."""
