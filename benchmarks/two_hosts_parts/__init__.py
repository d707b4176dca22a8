"""Parts of the benchmark of a cell on two hosts."""
