"""Figures of demand, power and energy."""
