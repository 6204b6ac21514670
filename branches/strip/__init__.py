"""``python -m branches.strip``: states of closed strips of given dimensions and snap loads of arches, in SI units."""
