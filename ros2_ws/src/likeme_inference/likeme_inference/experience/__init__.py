"""What the robot did and what came of it: trials as facts, where they are kept, how many more."""
