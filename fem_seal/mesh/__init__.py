"""Triangulations: nested meshes of a grid, meshes of shapes, and their refinement by bisection."""
