"""Measured logs: reading, judging, preparing."""
