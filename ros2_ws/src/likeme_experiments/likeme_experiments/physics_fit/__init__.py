"""Fit of the simulated cell's free parameters to the real robot's trials."""
