"""LikeMe bags: recorded files. Reading any bag, mending, cutting, checking and exporting it."""
