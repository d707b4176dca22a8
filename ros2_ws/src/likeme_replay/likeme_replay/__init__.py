"""Demonstrations on record: recording them, playing them again, and the log of what came of it."""
