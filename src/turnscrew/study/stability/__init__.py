"""Where a held grasp begins to swing: the loop's poles, and the simulator beside them."""
