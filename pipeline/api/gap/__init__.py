"""Logs against a machine: what the steps write."""
