"""Learning from trials, in simulated cells without ROS or in the running cell."""
