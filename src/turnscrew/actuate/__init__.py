"""From wanted contact forces and motions to what the robot accepts."""
