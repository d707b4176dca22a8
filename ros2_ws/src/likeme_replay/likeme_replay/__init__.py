"""Recording and replaying the ROS graph; the decision log."""
