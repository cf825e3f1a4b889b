"""Quantities other than the leak rate: constriction, threshold, aperture, trapped volume, verdict.

Each quantity has its own module and is computed only if the scene names it.
"""
