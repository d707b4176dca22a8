"""Perception: object states and human demonstrations from RGB-D frames."""
