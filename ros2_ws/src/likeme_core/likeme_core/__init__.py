"""Values that all packages share; ROS code that every node needs is in `ros`."""
