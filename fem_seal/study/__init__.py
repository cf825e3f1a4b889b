"""What an answer costs and how far to trust it: methods side by side, price of accuracy, limits."""
