"""Motions as segments: gaits and paths of the feet."""
