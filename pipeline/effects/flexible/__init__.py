"""Curves for what has no law in the catalogue."""
