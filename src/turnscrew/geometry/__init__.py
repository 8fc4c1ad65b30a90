"""Rotations, surfaces of revolution with exact derivatives, and closest points between them."""
