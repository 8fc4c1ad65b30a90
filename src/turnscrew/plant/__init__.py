"""What is controlled: the simulated cell of arm, hand, tool and screw, and its replay."""
