"""Env steps per CPU-second of swath, of the same problem in NumPy, and of CartPole elsewhere, in one run."""
