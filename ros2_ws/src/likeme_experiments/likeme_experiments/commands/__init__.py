"""The command lines of learn.sh, reproduce.sh, fit_physics.sh and gaze.sh."""
