"""Hosts on one machine, for benchmarks of a cell on a network."""
