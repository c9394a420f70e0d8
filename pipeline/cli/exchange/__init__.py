"""Verbs by which logs come in from other tools, and results go out to them."""
