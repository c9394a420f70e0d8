"""Fitting what the paper does not print."""
