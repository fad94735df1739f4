"""Every agent on the same pastures, and how much longer its way is than that of `horizon`."""
