"""What trained policies are worth: their curves, and their paths beside those of others on the same instances."""
