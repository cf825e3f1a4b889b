"""Checks of the method: exact cases, methods side by side, and what accuracy costs."""
