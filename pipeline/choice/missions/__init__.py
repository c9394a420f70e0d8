"""Robots' days as files."""
