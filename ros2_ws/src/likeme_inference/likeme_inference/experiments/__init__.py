"""The paper's tables and figures as functions: they return arrays and draw nothing."""
