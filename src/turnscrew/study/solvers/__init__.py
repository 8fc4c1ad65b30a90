"""The same frames put to all solvers of the pose."""
