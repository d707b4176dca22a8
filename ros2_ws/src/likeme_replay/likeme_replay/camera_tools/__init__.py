"""Tools of a person who sets up a camera: see, calibrate, teach."""
