"""What every node needs of ROS."""
