"""Imitation executed in simulated cells: a human demonstrates, the robot imitates."""
