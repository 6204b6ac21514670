"""``python -m branches.strip``: the states of closed strips of given dimensions, in SI units."""
