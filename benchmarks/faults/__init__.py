"""What the fault tests measured, as a page."""
