"""Which open points hang together, whether they join inlet and outlet, and where it is tightest."""
