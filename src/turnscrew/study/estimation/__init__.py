"""Recorded runs estimated again, by each part of the method, against the truth."""
