"""Torques against positions under the same disturbances, and what optimal contact forces save."""
