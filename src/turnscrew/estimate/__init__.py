"""Estimation: tool pose (III-A) and its filter, contacts, tip wrench (III-B), screw angle."""
