"""The operator's desk: what a person sees of a running cell, answers and stops."""
