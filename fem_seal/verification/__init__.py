"""Comparison of the flow methods with exact cases and with each other; the price of accuracy."""
