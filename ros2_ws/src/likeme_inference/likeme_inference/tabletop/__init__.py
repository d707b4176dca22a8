"""The discrete model of the paper (Methods, Case II), as plain Python without ROS."""
