"""What the trained policy is worth: its curve, and its paths beside those of others on the same instances."""
