"""Gaussian-process regression with Gaussian inputs: training, conditioning, exact moments."""
