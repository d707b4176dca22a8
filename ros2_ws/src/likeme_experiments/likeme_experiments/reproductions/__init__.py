"""What `scripts/reproduce.sh` can compute anew: one module a topic, gathered in `registry`."""
