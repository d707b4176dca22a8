"""Learning by trying: in cells of its own without ROS, or in the running cell."""
