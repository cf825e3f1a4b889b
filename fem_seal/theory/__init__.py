"""Theories of contact and leakage, and flow problems whose exact answers are known."""
