"""``python -m branches.graph DIR``: bifurcation diagrams as graphs: special points, and the pieces of branches between them."""
