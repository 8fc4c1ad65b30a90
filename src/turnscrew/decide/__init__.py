"""What to do next: the phases of the task, the finger gait and its plans."""
