"""Verification: exact cases, comparison of the methods, and the cost of accuracy."""
