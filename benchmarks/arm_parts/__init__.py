"""The driver of a real arm against a stand-in robot."""
