"""What else a seal engineer asks: how tight, how near to sealing, what is trapped, is it enough.

Each quantity is a module of its own and computed only if the scene names it.
"""
