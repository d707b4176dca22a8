"""Values that all packages share. Only `likeme_core.ros` needs ROS."""
