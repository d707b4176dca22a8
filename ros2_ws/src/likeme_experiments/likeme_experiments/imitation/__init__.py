"""Imitation carried out in simulated cells of its own: a person shows, the robot imitates."""
