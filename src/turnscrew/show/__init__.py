"""What people look at: progress while a run goes on, and its film afterwards."""
