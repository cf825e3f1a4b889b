"""Triangulations: the nested family of the pixel grid and its refinement by bisection."""
