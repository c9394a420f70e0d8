"""Filters, derivatives, noise and time grids."""
