"""The ROS side of holding and stopping."""
