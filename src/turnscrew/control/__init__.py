"""What wrench and motion the tool needs, and which forces of the fingertips give them (Section IV)."""
