"""Blind trials: hide an effect in a simulated machine, let the workflow answer, score it."""
