"""Verbs that look for a better machine."""
