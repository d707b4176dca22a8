"""Reproductions of the tables and figures, by topic; `registry` lists their names."""
