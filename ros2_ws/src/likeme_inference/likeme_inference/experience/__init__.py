"""Trials of the robot: values, files, the experience store, campaigns and exploration policies."""
