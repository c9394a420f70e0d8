"""Weights, sums over blocks, choices and intervals."""
