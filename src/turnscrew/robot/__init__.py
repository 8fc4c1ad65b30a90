"""The robot: arm and hand descriptions, kinematics and dynamics."""
