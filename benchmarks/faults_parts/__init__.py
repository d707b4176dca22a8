"""Fault injection: nodes in simulated time, and node processes."""
