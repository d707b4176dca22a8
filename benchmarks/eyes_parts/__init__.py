"""Parts of the benchmark `eyes`: what happens in the cell, the conditions, the scores."""
