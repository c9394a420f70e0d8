"""Calibrating what the paper does not print, and judging what it does."""
