"""What simulated grasps bear, beside what the envelope says."""
