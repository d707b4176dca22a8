"""ROS code that every node needs."""
