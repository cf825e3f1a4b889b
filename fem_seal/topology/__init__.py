"""Topology of a gap: connected clusters, percolation, critical constriction and pockets."""
