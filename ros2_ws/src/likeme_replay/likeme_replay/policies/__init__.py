"""Safety and liveness policies of the cell, checked on its topics alone."""
