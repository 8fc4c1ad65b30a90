"""Contacts of fingertips and handle: rolling kinematics, grasp matrix, friction cones."""
