"""Figures of measured against predicted."""
