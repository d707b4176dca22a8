"""Fits the few free numbers of the simulated cell to the real robot's trials."""
