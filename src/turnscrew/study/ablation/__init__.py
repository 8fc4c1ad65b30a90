"""What each of the measures that make the gait robust is worth."""
