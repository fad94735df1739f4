"""The other ways, each a process of its own: peers run with the Python of their own environment."""
