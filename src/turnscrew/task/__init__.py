"""The task: what is asked for, the loop that does it, and the record of what came of it."""
